#pragma once

#include "client/plot/canvas.h"
#include "client/plot/plot.h"

namespace legopt::client {

/// Font size for which lengths are stated; other sizes scale them.
inline constexpr double kUsualFont = kUsualFontSize_pt;
/// Height of a line of text, and width of the labels left of a plane, at that font size.
inline constexpr double kLineHeight = 12.0, kLabelWidth = 40.0;

/// Draws the axes and the series of a panel into a plane.
class PanelDrawing {
 public:
  /// All arguments must outlive the drawing. `plane` has no space for labels: they are below and left of it.
  PanelDrawing(const Plot& plot, const PlotPanel& panel, const Rectangle& plane, double font_size, Canvas* canvas);

  void Draw();

 private:
  double Across(double x) const;  ///< coordinate of a value; infinite values are on the rim, or without one at the edge
  double Down(double y) const;
  double Scaled(double length) const { return scale_ * length; }
  void Text(std::string_view text, double x, double y, Align align, const Color& color, bool upwards = false);
  void DrawHorizontalAxis();
  void DrawVerticalAxis();
  void DrawDiagonal();
  void DrawSteps(const PlotSeries& series);
  void DrawLines(const PlotSeries& series);
  void DrawPoints(const PlotSeries& series);
  void DrawBox(const PlotSeries& series);
  void DrawRanks();
  void DrawRankName(const PlotSeries& series, double level, bool left);

  const Plot& plot_;
  const PlotPanel& panel_;
  Rectangle plane_;
  double font_, scale_;
  Canvas& canvas_;
};

/// Returns the height that a plane needs for its content.
double PlaneHeightOf(const PlotPanel& panel, double font_size);

}  // namespace legopt::client
