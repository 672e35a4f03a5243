#pragma once

#include <cairo.h>

#include <string>
#include <vector>

#include "client/plot/plot.h"

namespace legopt::client {

inline constexpr double kFigureWidth_pt = 720.0;

/// A rectangle of a figure, in points from its upper left corner.
struct Frame {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
};

/// Draws figures with cairo.
class Drawing {
 public:
  /// `context` is not owned; its unit is the point.
  explicit Drawing(cairo_t* context);
  /// Draws the whole figure starting at the upper left corner; returns its height.
  double DrawPlot(const Plot& plot);

 private:
  enum class Align { kLeft, kMiddle, kRight };

  /// Draws a panel. `frame.height` is the height of the title, equal for adjacent panels. Returns the y coordinate
  /// below.
  double DrawPanel(const PlotPanel& panel, const Frame& frame);
  void DrawAxes(const PlotPanel& panel, const Frame& plane);
  void DrawHorizontalAxis(const PlotAxis& axis, const Frame& plane);
  void DrawVerticalAxis(const PlotAxis& axis, const Frame& plane);
  void DrawSteps(const PlotPanel& panel, const PlotSeries& series, const Frame& plane);
  void DrawPoints(const PlotPanel& panel, const PlotSeries& series, const Frame& plane);
  double DrawLegend(const Plot& plot, double top);
  void DrawMark(std::size_t entry, double x, double y);
  /// Sets colour and dash of a series' line.
  void SetLine(std::size_t entry);
  void SetGrey(double level);
  void Line(double x0, double y0, double x1, double y1);
  void Text(const std::string& text, double x, double y, Align align = Align::kLeft);
  /// Returns the common height of the titles of panel `first` and the next.
  double TitleHeight(const Plot& plot, std::size_t first, double width);
  /// Breaks the text at words into lines of at most `width`.
  std::vector<std::string> Wrapped(const std::string& text, double width);
  /// Draws wrapped text; returns the y coordinate below.
  double Paragraph(const std::string& text, double left, double top, double width);
  double WidthOf(const std::string& text);

  cairo_t* context_;
};

}  // namespace legopt::client
