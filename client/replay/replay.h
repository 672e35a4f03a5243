#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "client/replay/stored_job.h"
#include "legopt/planning/job_runner.h"
#include "legopt/types/job.h"

namespace legopt::client {

/// Result of solving a stored job again.
struct Replay {
  std::int64_t job_id = 0;
  Reproduction outcome = Reproduction::kDiffers;
  /// Differences such as "iterations: 12 stored, 13 now"; for a crashed process, how it ended.
  std::vector<std::string> differences;
  std::string divergence;  ///< first difference between the traces; empty: none, or not recorded
};

/// Compares the stored result with the result of solving the job again. Times are not compared.
Replay CompareResults(const StoredJob& stored, const JobResult& now);

/// Returns a description of the first difference between a stored trace (legopt/planning/internal/trace.h) and a new
/// one: the first stored step that differs in anything except time. Empty: no difference, or no stored trace.
std::string FirstDivergence(std::span<const IterationRecord> stored, std::span<const IterationRecord> now);

/// Solves the jobs again, each in a separate process so that a crash is a possible outcome, `parallel` (>= 1) at a
/// time. Results are in the order of `jobs`. The time limit is ten times the stored one. `done` is called after each
/// job, by one thread at a time. `runner` must be for the jobs' dataset; it is not modified.
std::vector<Replay> ReplayJobs(JobRunner& runner, std::span<const StoredJob> jobs, int parallel,
                               const std::function<void(const Replay&)>& done);

}  // namespace legopt::client
