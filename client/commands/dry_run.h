#pragma once

#include <string>

#include "client/commands/submission.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// Prints the output of --dry-run on standard output: dataset, jobs of each method and task with their expected CPU
/// time, omitted problems, the number of reusable results, and the longest possible solving time, with every job at its
/// time limit. `known`: source of earlier results; may be nullptr. `slots`: number of parallel jobs, or 0 if unknown
/// before the pool starts. `outlook`: last sentence, about the action that was not taken.
void PrintDryRun(const Submission& submission, ResultSource* known, int slots, const std::string& outlook);

/// Prints the dry run as JSON: submission_id, jobs, left_out, estimate, known_results, spec.
void PrintDryRunJson(const Submission& submission, ResultSource* known);

}  // namespace legopt::client
