#pragma once

#include <string>
#include <vector>

/// Figures as data, drawn as text (plot_text.h) or as SVG and PNG (plot_image.h).
namespace legopt::client {

/// One direction of a panel.
struct PlotAxis {
  std::string title;         ///< with the unit
  bool logarithmic = false;  ///< its limits are positive then
  double from = 0.0, to = 1.0;
  bool rim = false;  ///< a strip beyond `to` for what is infinite
};

/// A place; infinite coordinates lie on the rim of their axis.
struct PlotPoint {
  double x = 0.0, y = 0.0;
};

/// What a method, or a comparison, gives to a panel.
struct PlotSeries {
  std::size_t entry = 0;          ///< of curves its place in Plot::entries: the same mark in all panels
  std::vector<PlotPoint> points;  ///< of a step curve: where it steps, ascending in x
  std::string note;               ///< of curves: figures in words, for the legend of the panel in text
};

enum class PlotKind {
  kSteps,  ///< curves, each constant to the right of its points, up to the end of the x axis; 0 before the first one
  kPoints  ///< marks, and the diagonal y = x
};

/// One pair of axes.
struct PlotPanel {
  std::string title;
  PlotKind kind = PlotKind::kSteps;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  std::vector<std::string> notes;  ///< sentences below it
};

/// A figure: panels with one legend.
struct Plot {
  std::vector<std::string> entries;  ///< names of curves, for the legend
  std::vector<PlotPanel> panels;
  std::string caption;  ///< below it: n, rule, dataset, seed, build
};

/// A labelled place of an axis.
struct PlotTick {
  double value = 0.0;
  std::string label;
};

/// Where `value` lies between the ends of the axis, in [0, 1]; what is beyond an end lies on it.
double PlaceOn(const PlotAxis& axis, double value);

/// Round values between the ends, ascending, at most `most` (>= 2) of them: of a logarithmic axis powers of ten, with 2
/// and 5 times these where there is room, else multiples of 1, 2 or 5 times a power of ten.
std::vector<PlotTick> TicksOf(const PlotAxis& axis, int most);

}  // namespace legopt::client
