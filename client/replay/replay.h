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

/// Where the trace of a job (legopt/solve/trace.h) and its history when it was solved again part, for people: the first
/// step that is kept and differs in anything but its time. Empty: nowhere, or none is stored.
std::string FirstDivergence(std::span<const IterationRecord> stored, std::span<const IterationRecord> now);

/// Solves the jobs again, each in a process of its own, so that one that crashes is an outcome, `parallel` (>= 1) at a
/// time; in the order of `jobs`. The clock ends none before ten times its limit. `done` is called after each, by one
/// thread at a time. `runner` is of the jobs' dataset, and stays as it is.
std::vector<Replay> ReplayJobs(JobRunner& runner, std::span<const StoredJob> jobs, int parallel,
                               const std::function<void(const Replay&)>& done);

}  // namespace legopt::client
