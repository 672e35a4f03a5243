#pragma once

#include <string>

#include "client/report/benchmark_table.h"
#include "client/report/solution_evaluation.h"

namespace legopt::client {

/// What stands above every table: the file, the dataset, the rule; how many of the dataset's problems the file holds;
/// whose definitions were used, and which of them are not the dataset's. One sentence per line.
std::string EvaluationCaption(const EvaluationReport& report);

/// Per method: successes of n, mean cost, mean time (per waypoint, over successes); where a method leaves problems out,
/// how many are in the file; where definitions differ, how many of the successes are by the file's. Problems that the
/// dataset does not have make a table of their own.
///
/// Text and Markdown go on with every solution that fails under the rule with the judge's detail, and of motions what
/// lies between their waypoints. LaTeX (booktabs) has the tables only. CSV has one line per method with all counts.
/// JSON holds all of it and every judged solution.
std::string RenderEvaluation(const EvaluationReport& report, TableFormat format, const TableStyle& style = {});

}  // namespace legopt::client
