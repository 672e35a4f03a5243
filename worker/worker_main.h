#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "programs/build_identity.h"
#include "programs/process_start.h"
#include "worker/job_executor.h"

namespace legopt::worker {

/// What a worker was given to work with.
struct WorkerInputs {
  std::vector<std::filesystem::path> datasets;  ///< folders
  std::vector<std::filesystem::path> solvers;   ///< declarations of solvers of others
};

/// Makes the executor of a job process. Called in the job process only.
using ExecutorFactory = std::function<std::unique_ptr<JobExecutor>(WorkerInputs inputs)>;

/// The program `legopt-worker` around an executor: parses the command line, then runs either the supervisor or, when
/// the supervisor has started this very program so, one job process. Returns the exit status (exit_codes.h). Tests make
/// workers with executors of their own of it. `build` tells what the program was made from. Call once, from
/// programs::RunProgram, which reports its exceptions.
int WorkerMain(int argc, char** argv, const programs::BuildFacts& build, const ExecutorFactory& make_executor);

/// Whether WorkerMain is going to run a supervisor or a job process.
programs::ProcessKind KindOf(int argc, const char* const* argv);

}  // namespace legopt::worker
