#pragma once

#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "worker/external/external_solvers.h"

namespace legopt::external {

/// Result of one check of an external solver.
struct SolverDiagnostic {
  std::string check;  ///< name, e.g. "repeats"
  bool passed = true;
  std::string detail;  ///< details for humans
};

/// Checks the first of the declared solvers on the dataset's shortest posture and the first window of its shortest
/// motion: it must say hello, follow the protocol, return the same bits again, and obey `cancel`. Estimates the time of
/// a whole motion from that window. Reports whether the problems were solved, but does not require it. Omits checks
/// that are impossible after a failure. Throws InputError if the dataset has no problem of a task.
std::vector<SolverDiagnostic> CheckSolver(ExternalSolvers& solvers, const std::shared_ptr<const Dataset>& dataset);

}  // namespace legopt::external
