#pragma once

#include <string>

#include "client/commands/submission.h"
#include "client/report/result_source.h"

namespace legopt::client {

/// What --dry-run prints on standard output instead of submitting: dataset, jobs of each method and task and the CPU
/// time that they are expected to take, what was left out, how many finished results would be taken over, and the
/// longest that solving can take, every job at its time limit. `known`: where results of before are; may be null.
/// `slots`: jobs at the same time, or 0 where only the pool knows. `outlook` ends it: what would have been done.
void PrintDryRun(const Submission& submission, ResultSource* known, int slots, const std::string& outlook);

/// The same as JSON: submission_id, jobs, left_out, estimate, known_results, spec.
void PrintDryRunJson(const Submission& submission, ResultSource* known);

}  // namespace legopt::client
