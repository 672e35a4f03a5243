#include "client/figures/figures.h"

#include <algorithm>
#include <cmath>

#include "app/printable.h"
#include "client/compare/comparison_report.h"
#include "client/figures/figure_panel.h"
#include "client/report/benchmark_table.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kPercent = 100.0, kMinSpan = 2.0;

// Returns e.g. "SQP, 10 restarts, sample 80 %": name and distinguishing properties of a row.
std::string NameOf(const StatisticsTable& table, const StatisticsRow& row) {
  const auto differ = [&](auto MethodIdentity::*figure) {
    return std::any_of(table.rows.begin(), table.rows.end(),
                       [&](const StatisticsRow& other) { return other.method.*figure != row.method.*figure; });
  };
  const MethodIdentity& method = row.method;
  std::string name = row.title;
  if (differ(&MethodIdentity::multi_starts)) name += ", " + std::to_string(method.multi_starts) + " restarts";
  if (differ(&MethodIdentity::sample_size)) name += ", sample " + std::to_string(method.sample_size) + " %";
  if (differ(&MethodIdentity::collision)) name += ", " + std::string(ToString(method.collision));
  return app::Printable(name);
}

std::string Percents(double share) { return FormatGeneral(kPercent * share, 4) + " %"; }

PlotSeries CurveOf(std::size_t entry, const statistics::StepCurve& curve) {
  PlotSeries series{entry, {}, {}};
  for (std::size_t i = 0; i < curve.at.size(); ++i) series.points.push_back({curve.at[i], kPercent * curve.share[i]});
  series.note =
      "best on " + Percents(curve.At(1.0)) + ", solves " + Percents(curve.share.empty() ? 0.0 : curve.share.back());
  return series;
}

PlotPanel ProfilePanel(const StatisticsTable& table, const BenchmarkColumn& column) {
  const statistics::PerformanceProfile& profile = table.columns.at(column).profile;
  PlotPanel panel =
      PanelOf(column, static_cast<std::size_t>(profile.problems), table.columns.at(column).left_out, PlotKind::kSteps);
  panel.x = {std::string(table.columns.at(column).by_work ? "work" : "time") + " over that of the best method", true,
             1.0, kMinSpan, false};
  panel.y = {"problems solved within it (%)", false, 0.0, kPercent, false};
  std::size_t next = 0;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const auto cell = table.rows[row].cells.find(column);
    if (cell == table.rows[row].cells.end() || cell->second.n == 0 || next == profile.curves.size()) continue;
    const statistics::StepCurve& curve = profile.curves[next++];
    if (!curve.at.empty()) panel.x.to = std::max(panel.x.to, curve.at.back());
    panel.series.push_back(CurveOf(row, curve));
  }
  if (profile.unsolved > 0) {
    panel.notes.insert(panel.notes.begin(), std::to_string(profile.unsolved) + " of them no method solved.");
  }
  return panel;
}

PlotPanel ScatterPanel(const Comparison& comparison, const CellComparison& cell, const TimeUnit& unit) {
  const double per_ms = kMilliseconds.seconds / unit.seconds;
  PlotSeries series;
  std::vector<double> values;
  for (const PairedTimes& times : cell.times) {
    if (std::isinf(times.a_ms) && std::isinf(times.b_ms)) continue;
    series.points.push_back({times.a_ms * per_ms, times.b_ms * per_ms});
    values.insert(values.end(), {times.a_ms * per_ms, times.b_ms * per_ms});
  }
  PlotPanel panel;
  panel.title = app::Printable(TitleOf(comparison, cell));
  panel.kind = PlotKind::kPoints;
  panel.x = AxisFor("time of A (" + std::string(unit.name) + ")", values);
  panel.y = AxisFor("time of B (" + std::string(unit.name) + ")", values);
  panel.x.rim = panel.y.rim = true;
  panel.series = {series};
  panel.notes = {"Pairs " + DescribePairs(cell.success.counts) +
                 ". Below the diagonal B is faster; on a rim one of the two failed."};
  return panel;
}

}  // namespace

std::vector<std::string> EntryNamesOf(const StatisticsTable& table) {
  std::vector<std::string> names;
  for (const StatisticsRow& row : table.rows) names.push_back(NameOf(table, row));
  return names;
}

Plot ProfilePlot(const StatisticsTable& table) {
  Plot plot;
  plot.entries = EntryNamesOf(table);
  for (const auto& [column, common] : table.columns) plot.panels.push_back(ProfilePanel(table, column));
  plot.caption = app::Printable(CaptionOf("Performance profiles", table));
  return plot;
}

Plot ScatterPlot(const Comparison& comparison, const TimeUnit& unit) {
  Plot plot;
  for (const CellComparison& cell : comparison.cells) plot.panels.push_back(ScatterPanel(comparison, cell, unit));
  plot.caption =
      app::Printable("A: " + comparison.a.title + ". B: " + comparison.b.title + ". " + DescribeComparison(comparison));
  return plot;
}

}  // namespace legopt::client
