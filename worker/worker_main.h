#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "app/build_identity.h"
#include "app/processes.h"
#include "worker/job_executor.h"

namespace legopt::worker {

/// Datasets and solvers of a worker.
struct WorkerInputs {
  std::vector<std::filesystem::path> datasets;  ///< folders of the datasets
  std::vector<std::filesystem::path> solvers;   ///< declaration files of external solvers
};

/// Creates the executor of a job process. Called only in the job process.
using ExecutorFactory = std::function<std::unique_ptr<JobExecutor>(WorkerInputs inputs)>;

/// Main function of `legopt-worker` with an executor: parses the command line, then runs either the supervisor or, if
/// the supervisor has started this program for that, one job process. Returns the exit status (exit_codes.h). Tests use
/// it to create workers with other executors. `build` describes the program's build. Call once, from
/// app::RunProgram, which reports its exceptions.
int WorkerMain(int argc, char** argv, const app::BuildFacts& build, const ExecutorFactory& make_executor);

/// Returns whether WorkerMain will run a supervisor or a job process.
app::ProcessKind KindOf(int argc, const char* const* argv);

}  // namespace legopt::worker
