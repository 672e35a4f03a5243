#pragma once

#include <cairo.h>

#include <string>
#include <vector>

#include "client/plot/plot.h"

namespace legopt::client {

inline constexpr double kFigureWidth_pt = 720.0;

/// A rectangle of a figure, points from its upper left corner.
struct Frame {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
};

/// Draws figures with cairo.
class Drawing {
 public:
  /// `context` is not owned; its unit is the point.
  explicit Drawing(cairo_t* context);
  /// Draws all of it from the upper left corner; gives its height.
  double DrawPlot(const Plot& plot);

 private:
  enum class Align { kLeft, kMiddle, kRight };

  /// `frame.height`: of the title, so that panels beside each other begin alike. Gives what is below it.
  double DrawPanel(const PlotPanel& panel, const Frame& frame);
  void DrawAxes(const PlotPanel& panel, const Frame& plane);
  void DrawHorizontalAxis(const PlotAxis& axis, const Frame& plane);
  void DrawVerticalAxis(const PlotAxis& axis, const Frame& plane);
  void DrawSteps(const PlotPanel& panel, const PlotSeries& series, const Frame& plane);
  void DrawPoints(const PlotPanel& panel, const PlotSeries& series, const Frame& plane);
  double DrawLegend(const Plot& plot, double top);
  void DrawMark(std::size_t entry, double x, double y);
  /// Sets the line of a series: colour and dash.
  void SetLine(std::size_t entry);
  void SetGrey(double level);
  void Line(double x0, double y0, double x1, double y1);
  void Text(const std::string& text, double x, double y, Align align = Align::kLeft);
  /// The height of titles beside each other: panels `first` and the next.
  double TitleHeight(const Plot& plot, std::size_t first, double width);
  /// Lines of at most `width`, at words.
  std::vector<std::string> Wrapped(const std::string& text, double width);
  /// Draws them; gives what is below.
  double Paragraph(const std::string& text, double left, double top, double width);
  double WidthOf(const std::string& text);

  cairo_t* context_;
};

}  // namespace legopt::client
