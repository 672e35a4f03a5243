#pragma once

#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "legopt_msg/lease.hpp"
#include "legopt_msg/result_request.hpp"
#include "words/capability.h"

namespace legopt::worker {

/// Something that a job process has loaded and that jobs may need.
struct Capability {
  std::string name;                                ///< of a dataset or solver; the word of a collision model
  std::string hash;                                ///< content hash, 64 lower-case hex digits; of a model empty
  CapabilityKind kind = CapabilityKind::kDataset;  ///< what it is

  bool operator==(const Capability&) const = default;
};

/// This worker lacks something that the job needs. The job is given back without a charge, and the worker gets no more
/// of its kind.
class JobRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What a job process does with a job. The shipped one solves and judges (solve_executor.h); tests bring others, among
/// them some that misbehave. Lives in the child process, used by its only thread.
class JobExecutor {
 public:
  /// See worker::JobHooks; always set.
  struct Hooks {
    std::function<bool()> cancelled;
    std::function<void(int, int)> progress;
    std::function<void()> judging;
  };

  virtual ~JobExecutor() = default;

  /// Called once, before any job; returns at least one dataset. Throws InputError when one cannot be used.
  virtual std::vector<Capability> Load() = 0;

  /// Runs one job. `options_json` is the canonical text of the method whose hash the lease names. The caller sets the
  /// identification of the lease (worker_id, job_id, attempt, token); the executor fills all else, `outcome` included.
  /// std::bad_alloc is reported as memory limit, JobRefused as refused, any other exception as error, with its text.
  virtual legopt_msg::result_request Execute(const legopt_msg::lease& job, std::string_view options_json,
                                             const Hooks& hooks) = 0;
};

}  // namespace legopt::worker
