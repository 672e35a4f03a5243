#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/types/job.h"
#include "legopt_msg/lease.hpp"
#include "legopt_msg/result_request.hpp"

namespace legopt::worker {

/// Capability that a job process provides and jobs may require.
struct Capability {
  std::string name;  ///< name of a dataset or solver; enum name of a collision model
  std::string hash;  ///< content hash, 64 lower-case hex digits; empty for a model
  CapabilityKind kind = CapabilityKind::kDataset;

  bool operator==(const Capability&) const = default;
};

/// Error: this worker lacks a capability that the job requires. The job is released without a charge, and the worker
/// receives no more jobs of its kind.
class JobRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs jobs in a job process. The production executor solves and judges (solve_executor.h); tests use others, some of
/// which misbehave. Used by the only thread of the child process.
class JobExecutor {
 public:
  /// See JobHooks; all functions are set.
  struct Hooks {
    std::function<bool()> cancelled;
    std::function<void(int, int)> progress;
    std::function<void()> judging;
  };

  virtual ~JobExecutor() = default;

  /// Called once, before any job. Returns at least one dataset. Throws InputError if one cannot be used.
  virtual std::vector<Capability> Load() = 0;

  /// Runs one job. `options_json` is the canonical text of the method whose hash is in the lease. The caller sets the
  /// identification of the lease (worker_id, job_id, attempt, token); the executor sets all other fields, including
  /// `outcome`. std::bad_alloc is reported as memory limit, JobRefused as refused, any other exception as error with
  /// its text.
  virtual legopt_msg::result_request Execute(const legopt_msg::lease& job, std::string_view options_json,
                                             const Hooks& hooks) = 0;
};

/// Maximum lengths of texts in a result. Longer ones are truncated (the log at its beginning, others at the end).
inline constexpr std::size_t kMaxMessageBytes = 2000;
inline constexpr std::size_t kMaxLogTailBytes = 4096;

/// Returns a result without a solution: numbers NaN, texts empty, except for `outcome` and `message` (truncated and
/// made printable).
legopt_msg::result_request ResultWithoutSolution(ReportedOutcome outcome, std::string_view message);

/// Returns `text` truncated at its end to `max_bytes`, without control characters (app::WithoutControls).
std::string PrintableText(std::string_view text, std::size_t max_bytes);
/// Returns `text` truncated at its beginning, because the last lines of a log matter; without control characters.
std::string PrintableTail(std::string_view text, std::size_t max_bytes);

}  // namespace legopt::worker
