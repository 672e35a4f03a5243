#pragma once

#include <span>
#include <string>
#include <vector>

#include "legopt/judge/judge.h"

namespace legopt {

/// One judged solution, input of a summary.
struct JudgedSolution {
  std::string method;  ///< Solution::method
  int problem_id;      ///< id in the file
  double time_s;       ///< total for the problem; NaN if unknown
  Evaluation evaluation;
  bool other_definition = false;  ///< judged with a definition that differs from the dataset's
};

/// One row of a benchmark table (docs/explanation/judge.md#table-rows-and-times).
struct MethodSummary {
  std::string method;             ///< Solution::method
  int num_problems = 0;           ///< n: number of posed problems, even if unsolved or not in the file
  int num_solved = 0;             ///< number of problems solved by the requested rule
  double mean_cost = 0;           ///< mean cost per waypoint over solved problems; NaN if there are none
  double mean_time_s = 0;         ///< mean time over solved problems; NaN if none is solved with a known time
  int num_other_definition = 0;   ///< number of solved problems judged with a definition that differs from the
                                  ///< dataset's
  std::vector<int> missing = {};  ///< ids of posed problems without a solution, in the order of `posed`; counted as not
                                  ///< solved
};

/// Returns one row per method, in the order of first appearance. Every solved problem has the same weight, whatever its
/// length. Success by a rule implies success by more lenient ones.
///
/// `posed`: ids of the problems that every method should have solved; `solutions` contains no others. Empty: each
/// method's n is the number of its solutions.
std::vector<MethodSummary> Summarize(std::span<const JudgedSolution> solutions, Rule rule,
                                     std::span<const int> posed = {});

}  // namespace legopt
