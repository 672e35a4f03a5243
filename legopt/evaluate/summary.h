#pragma once

#include <span>
#include <string>
#include <vector>

#include "legopt/evaluate/judge.h"

namespace legopt {

/// One judged solution, as the summary needs it.
struct JudgedSolution {
  std::string method;
  int problem_id;
  double time_s;  ///< total for the problem
  Evaluation evaluation;
};

/// Which of the judge's two verdicts counts.
enum class Rule { kLiteral, kStrict };

/// One row of a benchmark table (reference 1.7).
struct MethodSummary {
  std::string method;
  int num_problems = 0;
  int num_solved = 0;
  double mean_cost = 0;    ///< mean over solved problems of the cost per waypoint; NaN when nothing was solved
  double mean_time_s = 0;  ///< mean over solved problems of time per waypoint; NaN when nothing was solved or timed
};

/// One row per method, in the order of first appearance. Every solved problem weighs the same, whatever its length.
/// Under kStrict a mean covers the solutions that are feasible by both rules: strict success implies literal success.
std::vector<MethodSummary> Summarize(std::span<const JudgedSolution> solutions, Rule rule);

}  // namespace legopt
