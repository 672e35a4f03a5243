#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "legopt/planning/job_runner.h"
#include "worker/external/external_solvers.h"
#include "worker/job_executor.h"
#include "worker/worker_main.h"

namespace legopt::worker {

/// Production executor: loads datasets from folders, solves and judges.
///
/// A job is refused (JobRefused) unless a dataset with the job's content hash was loaded, its method's options can be
/// read and have the given hash, and its external solver is the declared one.
class SolveExecutor final : public JobExecutor {
 public:
  explicit SolveExecutor(WorkerInputs inputs);

  /// Reads the declarations, starts the launcher of external solvers (new processes are forbidden later), then builds
  /// collision models and judges. Throws InputError and std::system_error.
  std::vector<Capability> Load() override;
  legopt_msg::result_request Execute(const legopt_msg::lease& lease, std::string_view options_json,
                                     const Hooks& hooks) override;

 private:
  const Method& ReadMethod(const std::string& hash, std::string_view options_json);

  WorkerInputs inputs_;
  std::optional<external::ExternalSolvers> external_;  // set by Load
  SolverRegistry registry_;
  std::map<std::string, JobRunner> runners_;  // key: content hash
  std::map<std::string, Method> methods_;     // key: hash of the method
};

/// Returns the fields of a result that describe `job`'s outcome (without identification).
legopt_msg::result_request ToMessage(const JobResult& job);

}  // namespace legopt::worker
