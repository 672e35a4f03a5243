#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "client/compare/solves.h"

namespace legopt::client {

/// Describes cells of one task and initialization, one per method. "problems" are all problems that any method was
/// asked to solve. Each method, in the order of `cells`, has one element per problem, null if unsolved or missing:
/// "time_ms" and "cost" (means of solved repetitions), "time_ratio" and "cost_ratio" (relative to the best method),
/// "share" (share of repetitions that solved it), "job" (first repetition). In addition, there are curves: performance
/// "profiles" of time and cost, "runtimes" (distribution of the times of all runs), "costs" (share of problems within a
/// ratio of the best cost of these methods). A curve is {x: [...], y: [...]}; null for a method without problems. All
/// statistics are computed by legopt/statistics.
nlohmann::ordered_json DescribeColumn(const std::vector<const SolveCell*>& cells);

}  // namespace legopt::client
