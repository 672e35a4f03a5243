#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "legopt_msg/lease.hpp"
#include "legopt_msg/result_request.hpp"

namespace legopt::worker {

/// Name and content hash (64 lower-case hex digits) of a dataset that was loaded from its files.
struct LoadedDataset {
  std::string name;
  std::string hash;
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

  /// Called once, before any job. Throws InputError when a dataset cannot be used.
  virtual std::vector<LoadedDataset> Load() = 0;

  /// Runs one job. `options_json` is the canonical text of the method whose hash the lease names. The caller sets the
  /// identification of the lease (worker_id, job_id, attempt, token); the executor fills all else, `outcome` included.
  /// std::bad_alloc is reported as memory limit, any other exception as error, with its text.
  virtual legopt_msg::result_request Execute(const legopt_msg::lease& job, std::string_view options_json,
                                             const Hooks& hooks) = 0;
};

}  // namespace legopt::worker
