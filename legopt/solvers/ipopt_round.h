#pragma once

#include <Eigen/Core>
#include <optional>

#include "legopt/solvers/ipopt_options.h"
#include "legopt/solvers/slotted_program.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/subproblem/quiet_ipopt.h"

namespace legopt {

/// Result of one solve of a SlottedProgram by Ipopt.
struct IpoptRound {
  QuietIpopt::End end = QuietIpopt::End::kFailed;  ///< Ipopt's exit status
  std::optional<SolveStatus> stop_status;          ///< last answer of the stop check
  int iterations = 0;                              ///< number of Ipopt iterations in this round
  Eigen::VectorXd last_dx;                         ///< Ipopt's last point, without the excess variables
  Eigen::VectorXd best_x;  ///< best point evaluated: feasible before infeasible, then lower cost or smaller violation
  ObjectiveValue best_value;  ///< exact value at best_x
};

/// Solves `slotted` from its base point with at most `max_iterations`; calls the stop check and adds to the history.
/// Variables are dx, starting at zero, and an excess s for each preference row p: p - s <= 0, s >= 0, and weight * s in
/// the objective. Rounds after the first (`round` > 0) start near an optimum. Exceptions of terms and of the stop check
/// are rethrown after Ipopt has returned.
IpoptRound SolveByIpopt(SlottedProgram& slotted, const SolverContext& context, const IpoptOptions& options, int round,
                        int max_iterations);

}  // namespace legopt
