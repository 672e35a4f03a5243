#pragma once

#include <string>
#include <vector>

#include "client/report/benchmark_table.h"
#include "client/report/solution_evaluation.h"

namespace legopt::client {

/// Returns the text above the tables, one sentence per line: the file, the dataset and the rule; how many of the
/// dataset's problems the file contains; whose definitions were used, and which of them differ from the dataset's.
std::string EvaluationCaption(const EvaluationReport& report);

/// Returns the tables of methods, with times in `unit`, and `with_solutions` those of solutions; the first one has the
/// caption.
std::vector<Table> TablesOf(const EvaluationReport& report, const TimeUnit& unit, bool with_solutions);

/// Renders an evaluation. For each method: successes of n, mean cost, mean time (per waypoint, over successes); if a
/// method omits problems, the number in the file; if definitions differ, the number of successes by the file's
/// definitions. Problems that the dataset does not have are in a separate table.
///
/// Text and Markdown also list every solution that fails under the rule with the judge's detail, and the values between
/// waypoints of motions. LaTeX (booktabs) contains only the tables. CSV has one line per method with all counts. JSON
/// contains everything, including every judged solution.
///
/// With values of --rows or with style.columns, there is only the table of methods, in JSON as an array of rows.
std::string RenderEvaluation(const EvaluationReport& report, TableFormat format, const TableStyle& style = {},
                             const std::vector<std::string>& rows = {});

}  // namespace legopt::client
