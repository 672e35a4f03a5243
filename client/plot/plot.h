#pragma once

#include <optional>
#include <string>
#include <vector>

#include "client/report/text_layout.h"

namespace legopt::client {

/// Figures as data, rendered as text (plot.h) or into files (drawing.h).

inline constexpr double kUsualFontSize_pt = 9.0;

/// An axis of a panel.
struct PlotAxis {
  std::string title;         ///< includes the unit
  bool logarithmic = false;  ///< requires positive limits
  double from = 0.0, to = 1.0;
  bool rim = false;      ///< adds a strip beyond `to` for infinite values
  bool labelled = true;  ///< has ticks and their labels
};

/// A point; infinite coordinates are drawn on the rim of their axis.
struct PlotPoint {
  double x = 0.0, y = 0.0;
};

/// An interval of y.
struct PlotRange {
  double low = 0.0, high = 0.0;
};

/// Distribution of values, drawn as a box with whiskers. Quantiles may be infinite.
struct PlotBox {
  PlotRange whiskers, quartiles;
  double median = 0.0;
};

/// Data of a method or a comparison in a panel.
struct PlotSeries {
  std::size_t entry = 0;             ///< index of a curve in Plot::entries, which determines its mark in all panels
  std::vector<PlotPoint> points;     ///< ascending x for curves
  std::string note;                  ///< figures of a curve as text, shown in the legend of text output
  std::vector<PlotRange> band = {};  ///< range of y at each point of kLines; empty: none
  std::optional<PlotBox> box = {};   ///< content of kBoxes
};

enum class PlotKind {
  kSteps,   ///< curves that are constant to the right of each point up to the end of the x axis; 0 before the first
            ///< point
  kPoints,  ///< marks, and the diagonal y = x
  kLines,   ///< polylines, with bands
  kBoxes,   ///< one box per series, side by side
  kRanks    ///< one point per series on the x axis, with its name, and bars over points that do not differ
};

/// A pair of axes.
struct PlotPanel {
  std::string title;
  PlotKind kind = PlotKind::kSteps;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  std::vector<std::string> notes;      ///< sentences below the panel
  std::vector<PlotRange> groups = {};  ///< bars of kRanks, as intervals of x
};

/// A figure: panels with a common legend.
struct Plot {
  std::vector<std::string> entries;  ///< names of the curves, for the legend
  std::vector<PlotPanel> panels;
  std::string caption;  ///< text below the figure: n, rule, dataset, seed, build
};

/// A labelled position on an axis.
struct PlotTick {
  double value = 0.0;
  std::string label;
};

/// Returns the relative position of `value` on the axis, clamped to [0, 1]. The limits must be finite, from < to.
double PlaceOn(const PlotAxis& axis, double value);

/// Returns at most `most` (>= 2) round values within the limits, ascending. For a logarithmic axis: powers of ten, and
/// 2 and 5 times these if there is space; otherwise multiples of 1, 2 or 5 times a power of ten.
std::vector<PlotTick> TicksOf(const PlotAxis& axis, int most);

/// Renders the figure, of kSteps or kPoints, in ASCII, panels one below the other, each with a legend. A step curve is
/// drawn with the letter of its series; where curves overlap, their letters alternate so that none is hidden. A cell of
/// a point panel shows the number of points: "o" for one, digits, "#" for ten and more; infinite values are beyond the
/// bar of their axis. Lines are limited to the layout's width (default: 80; clamped to 40 .. 100), except titles and
/// notes.
std::string RenderPlotText(const Plot& plot, const TextLayout& layout = {});

}  // namespace legopt::client
