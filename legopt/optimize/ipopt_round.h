#pragma once

#include <Eigen/Core>
#include <optional>

#include "legopt/optimize/ipopt_options.h"
#include "legopt/optimize/slotted_program.h"
#include "legopt/optimize/solver.h"
#include "legopt/subproblem/quiet_ipopt.h"

namespace legopt {

/// How one solve of a SlottedProgram by Ipopt ended.
struct IpoptRound {
  QuietIpopt::End end = QuietIpopt::End::kFailed;  ///< what Ipopt said
  std::optional<SolveStatus> stop_status;          ///< what the stop check said last
  int iterations = 0;                              ///< of Ipopt in this round
  Eigen::VectorXd last_dx;                         ///< where Ipopt ended; the step alone
  Eigen::VectorXd best_x;     ///< best point met: feasible before infeasible, then lower cost or smaller violation
  ObjectiveValue best_value;  ///< exact, at best_x
};

/// Solves `slotted` from its base point with at most `max_iterations`; asks the stop check, and adds to the history.
/// Variables are dx, starting at zero, and for each row p of a preference its excess s: p - s <= 0, s >= 0, and weight
/// s in the objective. Rounds after the first (`round` > 0) start near an optimum. Throws what a term or the stop check
/// threw, outside of Ipopt.
IpoptRound SolveByIpopt(SlottedProgram& slotted, const SolverContext& context, const IpoptOptions& options, int round,
                        int max_iterations);

}  // namespace legopt
