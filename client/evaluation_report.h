#pragma once

#include <string>
#include <vector>

#include "client/listing.h"
#include "legopt/evaluate/judge.h"
#include "legopt/evaluate/solution_file.h"
#include "legopt/evaluate/summary.h"

namespace legopt::client {

/// One solution as judged.
struct JudgedRow {
  std::string method;
  int problem_id = 0;
  double time_s = 0;  ///< for the problem
  Evaluation evaluation;
  bool claim_differs = false;  ///< the file's `success` is not the literal verdict
};

struct EvaluationReport {
  Task task = Task::kPosture;
  Rule rule = Rule::kLiteral;
  std::vector<JudgedRow> rows;           ///< in file order
  std::vector<MethodSummary> summaries;  ///< one per method, in file order
  std::vector<std::string> warnings;     ///< e.g. definitions that differ from the dataset's
};

/// Judges every solution of a file. Problem definitions are the file's own, as in the original evaluator; a problem
/// that has none takes the dataset's (InputError when the dataset has no such problem).
EvaluationReport EvaluateSolutions(const SolutionFile& file, Judge& judge, Rule rule);

/// Per method: successes, mean cost, mean time (per waypoint, over successes). Then, except in CSV, every solution that
/// fails under the rule with the judge's detail, and of motions what lies between their waypoints. JSON holds every
/// judged solution.
std::string RenderEvaluation(const EvaluationReport& report, ListingFormat format);

}  // namespace legopt::client
