#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "client/compare/solves.h"

namespace legopt::client {

/// Of cells of one task and start, one per method: for each problem that any of them was asked to solve, in "problems",
/// and each method in the order of `cells`, null where unsolved or missing: "time_ms" and "cost" (means of solved
/// repetitions), "time_ratio" and "cost_ratio" (to the best of them), "share" (of repetitions that solved it), "job"
/// (first repetition). Besides curves: "profiles" of time and cost, "runtimes" (distribution of the times of all runs),
/// "costs" (share of problems within a ratio of the best cost of these). A curve is {x: [...], y: [...]}; null for a
/// method without problems. All is computed by legopt/statistics.
nlohmann::ordered_json DescribeColumn(const std::vector<const SolveCell*>& cells);

}  // namespace legopt::client
