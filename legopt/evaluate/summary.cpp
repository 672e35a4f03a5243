#include "legopt/evaluate/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace legopt {
namespace {

/// Sums of one method; a time that is not available leaves the time mean, not the row, incomplete.
struct Sums {
  double cost = 0;
  double time_s = 0;
  int timed = 0;
};

double Mean(double sum, int count) { return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN(); }

}  // namespace

std::vector<MethodSummary> Summarize(std::span<const JudgedSolution> solutions, Rule rule) {
  std::vector<MethodSummary> rows;
  std::vector<Sums> sums;
  for (const JudgedSolution& solution : solutions) {
    const auto found =
        std::find_if(rows.begin(), rows.end(), [&](const MethodSummary& row) { return row.method == solution.method; });
    const auto index = static_cast<size_t>(found - rows.begin());
    if (found == rows.end()) {
      rows.push_back({.method = solution.method});
      sums.emplace_back();
    }
    ++rows[index].num_problems;
    const Evaluation& evaluation = solution.evaluation;
    if ((rule == Rule::kLiteral ? evaluation.literal : evaluation.strict) != Verdict::kSuccess) continue;
    ++rows[index].num_solved;
    sums[index].cost += evaluation.cost;
    if (std::isnan(solution.time_s)) continue;
    sums[index].time_s += solution.time_s / evaluation.num_waypoints;
    ++sums[index].timed;
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    rows[i].mean_cost = Mean(sums[i].cost, rows[i].num_solved);
    rows[i].mean_time_s = Mean(sums[i].time_s, sums[i].timed);
  }
  return rows;
}

}  // namespace legopt
