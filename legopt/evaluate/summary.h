#pragma once

#include <span>
#include <string>
#include <vector>

#include "legopt/evaluate/judge.h"

namespace legopt {

/// One judged solution, as the summary needs it.
struct JudgedSolution {
  std::string method;             ///< Solution::method
  int problem_id;                 ///< as in the file
  double time_s;                  ///< total for the problem; NaN when not available
  Evaluation evaluation;          ///< by the judge
  bool other_definition = false;  ///< judged by a definition that is not the dataset's
};

/// One row of a benchmark table (docs/readings.md#table-rows-and-times).
struct MethodSummary {
  std::string method;             ///< Solution::method
  int num_problems = 0;           ///< n: the problems that are posed, solved or not, in the file or not
  int num_solved = 0;             ///< by the rule asked for
  double mean_cost = 0;           ///< mean over solved problems of the cost per waypoint; NaN when nothing was solved
  double mean_time_s = 0;         ///< likewise the time; NaN when nothing was solved or timed
  int num_other_definition = 0;   ///< of the solved ones those judged by a definition that is not the dataset's
  std::vector<int> missing = {};  ///< ids of posed problems without a solution, in the order of `posed`; not solved
};

/// One row per method, in the order of first appearance. Every solved problem weighs the same, whatever its length.
/// Success by a rule implies success by those before it.
///
/// `posed` are the ids of the problems that every method should have solved; `solutions` hold no others. Empty: each
/// method's n is the number of its solutions.
std::vector<MethodSummary> Summarize(std::span<const JudgedSolution> solutions, Rule rule,
                                     std::span<const int> posed = {});

}  // namespace legopt
