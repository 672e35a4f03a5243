#include "client/figures/figure_panel.h"

#include <algorithm>
#include <cmath>

#include "app/printable.h"

namespace legopt::client {

PlotAxis AxisFor(const std::string& title, const std::vector<double>& values) {
  constexpr double kTen = 10.0, kRoom = 1.05, kSmallest = 1e-100, kLargest = 1e100;
  double least = INFINITY, most = -INFINITY;
  for (const double value : values) {
    if (!std::isfinite(value) || std::abs(value) > kLargest) continue;
    least = std::min(least, value);
    most = std::max(most, value);
  }
  PlotAxis axis;
  axis.title = title;
  if (least > kSmallest && std::isfinite(least)) {
    axis.logarithmic = true;
    axis.from = std::pow(kTen, std::floor(std::log10(least)));
    axis.to = std::max(std::pow(kTen, std::ceil(std::log10(most))), kTen * axis.from);
  } else if (std::isfinite(least)) {
    axis.from = std::min(least, 0.0);
    axis.to = most > axis.from ? axis.from + kRoom * (most - axis.from) : axis.from + 1.0;
  }
  return axis;
}

PlotPanel PanelOf(const BenchmarkColumn& column, std::size_t problems, const std::vector<std::string>& left_out,
                  PlotKind kind) {
  PlotPanel panel;
  panel.kind = kind;
  panel.title = ColumnTitle(column) + ": " + std::to_string(problems) + (problems == 1 ? " problem" : " problems");
  std::string titles;
  for (const std::string& title : left_out) titles += (titles.empty() ? "" : ", ") + title;
  if (!titles.empty()) panel.notes.push_back(app::Printable("Left out, without a completed problem: " + titles + "."));
  if (problems == 0) panel.notes.emplace_back("No problem has been completed by every method.");
  return panel;
}

}  // namespace legopt::client
