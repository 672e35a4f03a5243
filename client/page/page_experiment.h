#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/comparison_sides.h"
#include "client/compare/solves.h"
#include "client/report/result_source.h"
#include "legopt/types/check.h"

namespace legopt::client {

/// Describes cells of one task and initialization, one per method. "problems" are all problems that any method was
/// asked to solve. Each method, in the order of `cells`, has one element per problem, null if unsolved or missing:
/// "effort_ms" and "cost" (means of solved repetitions), "effort_ratio" and "cost_ratio" (relative to the best method),
/// "share" (share of repetitions that solved it), "job" (first repetition). "effort" is "work" if the work of all
/// complete problems was counted, else "time". In addition, there are curves: performance "profiles" of effort and
/// cost, "efforts" (distribution of the efforts of all runs), "costs" (share of problems within a ratio of the best
/// cost of these methods). A curve is {x: [...], y: [...]}; null for a method without problems. All statistics are
/// computed by legopt/statistics.
nlohmann::ordered_json DescribeColumn(const std::vector<const SolveCell*>& cells);

/// An experiment of a page.
struct PageExperiment {
  SolvedExperiment experiment;  ///< includes its solves
  nlohmann::ordered_json json;  ///< element of "experiments" in docs/reference/page-data.md, without solutions
};

/// Results to show of an experiment.
struct PageSelection {
  Rule rule = Rule::kSolid;
  ResultFilter filter = {};
};

/// Reads and computes all figures of the selected results of an experiment: table, statistics, causes of failures,
/// profiles, distributions, ratios by problem, its jobs, and pairwise comparisons of its methods if there are at most
/// kMaxCompared. `place` is the displayed name of its database; `source_options` opens it again. Throws the errors of
/// ReadBenchmarkTable.
PageExperiment DescribeExperiment(ResultSource& source, const SourceOptions& source_options, const std::string& place,
                                  std::optional<std::int64_t> id, const PageSelection& selection);

/// Maximum number of methods that are all compared pairwise; with more methods, only the first is compared with each
/// other one.
inline constexpr std::size_t kMaxCompared = 12;

/// Describes one comparison: the figures of `legopt compare`, and the curves of these two alone, which differ from
/// curves of a larger set. `a` and `b` must be the two sides of `comparison`.
nlohmann::ordered_json DescribeComparison(const Comparison& comparison, const SolvedExperiment& a,
                                          const SolvedExperiment& b);

}  // namespace legopt::client
