#pragma once

#include <memory>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "programs/external/external_solvers.h"

namespace legopt::external {

/// One thing that a solver of others must do, and what it did.
struct SolverFinding {
  std::string check;   ///< e.g. "repeats"
  bool passed = true;  ///< it did
  std::string detail;  ///< for people
};

/// Tries the first of the declared solvers on the dataset's shortest posture and the first window of its shortest
/// motion: it says hello, keeps to the protocol, finds the same bits again, and obeys `cancel`. The time of a whole
/// motion is estimated from that window. Whether it solves anything is told and not demanded.
/// What cannot be tried after a failure is left out. Throws InputError when the dataset has no problem of a task.
std::vector<SolverFinding> CheckSolver(ExternalSolvers& solvers, const std::shared_ptr<const Dataset>& dataset);

}  // namespace legopt::external
