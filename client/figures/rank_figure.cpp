#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/compare/comparison.h"
#include "client/figures/figure_panel.h"
#include "client/figures/figures.h"
#include "client/figures/solve_figures.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

// Returns the values of two methods as differences of logarithms (of costs: plain differences). If only one
// method solved a problem, the difference is larger than all others.
std::vector<double> Differences(const std::vector<ProblemRuns>& a, const std::vector<ProblemRuns>& b, Measure measure) {
  const double least = measure == Measure::kTolerance ? kLeastTolerance : kShortest_ms;
  const auto scaled = [&](double value) {
    return measure == Measure::kCost ? value : std::log(std::max(value, least));
  };
  std::vector<double> differences(a.size(), 0.0);
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double of_a = ValueOfAll(a[i], measure), of_b = ValueOfAll(b[i], measure);
    if (!std::isfinite(of_a) || !std::isfinite(of_b)) continue;
    differences[i] = scaled(of_b) - scaled(of_a);
    largest = std::max(largest, std::abs(differences[i]));
  }
  for (std::size_t i = 0; i < a.size(); ++i) {
    const bool solved_a = std::isfinite(ValueOfAll(a[i], measure)), solved_b = std::isfinite(ValueOfAll(b[i], measure));
    if (solved_a != solved_b) differences[i] = (solved_a ? 1.0 : -1.0) * (2.0 * largest + 1.0);
  }
  return differences;
}

// Returns the Holm-adjusted p of every pair of methods: element [i][j], i < j.
std::vector<std::vector<double>> PairwiseP(const FigureColumn& column, Measure measure) {
  const std::size_t count = column.runs.size();
  std::vector<double> p;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      p.push_back(statistics::SignedRank(Differences(column.runs[i], column.runs[j], measure)).two_sided_p);
    }
  }
  const std::vector<double> adjusted = statistics::HolmAdjusted(p);
  std::vector<std::vector<double>> pairs(count, std::vector<double>(count, 1.0));
  std::size_t next = 0;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) pairs[i][j] = pairs[j][i] = adjusted[next++];
  }
  return pairs;
}

// Returns the largest groups of neighbours in `order` of which no two differ, as intervals of their ranks.
std::vector<PlotRange> GroupsOf(const std::vector<std::size_t>& order, const std::vector<double>& ranks,
                                const std::vector<std::vector<double>>& p) {
  std::vector<PlotRange> groups;
  std::size_t covered = 0;  // end of the last group
  for (std::size_t first = 0; first < order.size(); ++first) {
    std::size_t end = first + 1;
    const auto differs_from_none = [&](std::size_t candidate) {
      return std::all_of(order.begin() + static_cast<std::ptrdiff_t>(first),
                         order.begin() + static_cast<std::ptrdiff_t>(candidate),
                         [&](std::size_t other) { return p[other][order[candidate]] >= kSignificance; });
    };
    while (end < order.size() && differs_from_none(end)) ++end;
    if (end - first < 2 || end <= covered) continue;
    groups.push_back({ranks[order[first]], ranks[order[end - 1]]});
    covered = end;
  }
  return groups;
}

void DrawRanks(const FigureColumn& column, Measure measure, PlotPanel* panel) {
  const std::size_t count = column.runs.size();
  panel->x = {"mean rank by " + std::string(ToString(measure)), false, 1.0, std::max(static_cast<double>(count), 2.0)};
  if (count < 2 || column.problems() == 0) return;
  std::vector<std::vector<double>> values;
  for (std::size_t problem = 0; problem < column.problems(); ++problem) {
    auto& line = values.emplace_back();
    for (const auto& runs : column.runs) line.push_back(ValueOfAll(runs[problem], measure));
  }
  const statistics::FriedmanTest ranked = statistics::Friedman(values);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return ranked.mean_ranks[a] < ranked.mean_ranks[b]; });
  for (const std::size_t i : order) {
    panel->series.push_back({column.entries[i], {{ranked.mean_ranks[i], 0.0}}, FormatFixed(ranked.mean_ranks[i], 2)});
  }
  panel->groups = GroupsOf(order, ranked.mean_ranks, PairwiseP(column, measure));
  panel->notes.push_back("Friedman p " + FormatGeneral(ranked.p, 2) + ".");
}

}  // namespace

Plot RankPlot(const FigureData& data, Measure measure) {
  RequireMeasure(data, measure);
  if (data.table.rows.size() < 2) {
    throw ClientError(ExitCode::kUsage, "ranks compare at least two methods; the selection has one");
  }
  Plot plot;
  plot.entries = EntryNamesOf(data.table);
  for (const FigureColumn& column : data.columns) {
    DrawRanks(column, measure,
              &plot.panels.emplace_back(PanelOf(column.column, column.problems(), column.left_out, PlotKind::kRanks)));
  }
  plot.caption = app::Printable(CaptionOf("Mean ranks by " + std::string(ToString(measure)), data.table)) +
                 " Bars join methods of which no two differ (Wilcoxon's signed rank tests of all pairs, Holm-adjusted "
                 "p at least 0.05).";
  return plot;
}

}  // namespace legopt::client
