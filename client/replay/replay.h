#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "client/replay/stored_job.h"
#include "legopt/solve/job_runner.h"
#include "words/reproduction.h"

namespace legopt::client {

/// What came of solving a stored job again.
struct Replay {
  std::int64_t job_id = 0;
  Reproduction outcome = Reproduction::kDiffers;
  /// Each as "iterations: 12 stored, 13 now"; of a process that ended without an answer, how.
  std::vector<std::string> differences;
  std::string divergence;  ///< where the histories first part; empty: nowhere, or not recorded
};

/// The stored result beside that of solving the job again. Times are not compared.
Replay CompareResults(const StoredJob& stored, const JobResult& now);

/// Where two histories of one job part, for people: the first penalty value of a restart of a window at which steps,
/// accepted steps, cost or violation (to the six digits that are stored) differ. Empty: nowhere, or there is no stored
/// one.
std::string FirstDivergence(const std::string& stored, std::span<const IterationRecord> now);

/// Solves the jobs again, each in a process of its own, so that one that crashes is an outcome, `parallel` (>= 1) at a
/// time; in the order of `jobs`. The clock ends none before ten times its limit. `done` is called after each, by one
/// thread at a time. `runner` is of the jobs' dataset, and stays as it is.
std::vector<Replay> ReplayJobs(JobRunner& runner, std::span<const StoredJob> jobs, int parallel,
                               const std::function<void(const Replay&)>& done);

}  // namespace legopt::client
