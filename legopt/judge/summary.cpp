#include "legopt/judge/summary.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>

namespace legopt {
namespace {

/// Sums of one method. An unknown time is excluded from the mean time only.
struct Sums {
  std::set<int> ids;
  double cost = 0;
  double time_s = 0;
  int timed = 0;
};

double Mean(double sum, int count) { return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN(); }

/// Returns the index of a method's row and creates the row if necessary.
size_t RowOf(const std::string& method, std::vector<MethodSummary>* rows) {
  const auto found =
      std::find_if(rows->begin(), rows->end(), [&](const MethodSummary& row) { return row.method == method; });
  const auto index = static_cast<size_t>(found - rows->begin());
  if (found == rows->end()) rows->push_back({.method = method});
  return index;
}

void Add(const JudgedSolution& solution, Rule rule, MethodSummary* row, Sums* sums) {
  ++row->num_problems;
  sums->ids.insert(solution.problem_id);
  const Evaluation& evaluation = solution.evaluation;
  if (evaluation.by(rule) != Verdict::kSuccess) return;
  ++row->num_solved;
  row->num_other_definition += solution.other_definition ? 1 : 0;
  sums->cost += evaluation.cost;
  if (std::isnan(solution.time_s)) return;
  sums->time_s += solution.time_s / evaluation.num_waypoints;
  ++sums->timed;
}

}  // namespace

std::vector<MethodSummary> Summarize(std::span<const JudgedSolution> solutions, Rule rule, std::span<const int> posed) {
  std::vector<MethodSummary> rows;
  std::vector<Sums> sums;
  for (const JudgedSolution& solution : solutions) {
    const size_t index = RowOf(solution.method, &rows);
    sums.resize(rows.size());
    Add(solution, rule, &rows[index], &sums[index]);
  }
  for (size_t i = 0; i < rows.size(); ++i) {
    rows[i].mean_cost = Mean(sums[i].cost, rows[i].num_solved);
    rows[i].mean_time_s = Mean(sums[i].time_s, sums[i].timed);
    if (posed.empty()) continue;
    rows[i].num_problems = static_cast<int>(posed.size());
    std::copy_if(posed.begin(), posed.end(), std::back_inserter(rows[i].missing),
                 [&](int id) { return !sums[i].ids.contains(id); });
  }
  return rows;
}

}  // namespace legopt
