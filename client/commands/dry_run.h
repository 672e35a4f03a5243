#pragma once

#include <string>

#include "client/commands/submission.h"

namespace legopt::client {

/// What --dry-run prints on standard output instead of submitting: dataset, number of jobs, methods, what was left out,
/// and the longest that solving can take, every job at its time limit. `slots`: jobs at the same time, or 0 where only
/// the pool knows. `outlook` ends it: what would have been done.
void PrintDryRun(const Submission& submission, int slots, const std::string& outlook);

/// The same as JSON: submission_id, jobs, left_out, spec.
void PrintDryRunJson(const Submission& submission);

}  // namespace legopt::client
