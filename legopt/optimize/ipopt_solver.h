#pragma once

#include <Eigen/Core>
#include <optional>

#include "legopt/optimize/ipopt_options.h"
#include "legopt/optimize/slotted_program.h"
#include "legopt/optimize/solver.h"
#include "legopt/subproblem/quiet_ipopt.h"

namespace legopt {

/// Baseline: the whole problem as one nonlinear program by Ipopt (interior point, filter line search, MUMPS):
///
///     min F(x)   subject to   h(x) = 0,   g(x) <= 0,   bounds of x.
///
/// Variables are dx about a base point; rows that come and go get slots. SlottedProgram says how and why that is sound:
/// the feasible set of the program in slots is exactly the original one. Ipopt solves a sequence of such programs
/// ("rounds"), each from where the last one ended: a round that converged at rows without a slot of their own, or that
/// failed where it met such rows or came closer to feasibility, is followed by another one about the new point with
/// slots for all rows there. Most problems need one.
///
/// Second derivatives: Gauss-Newton for the costs plus a damping of the diagonal, none for the constraints; or Ipopt's
/// limited-memory BFGS of all.
/// When there are more equality rows than variables, equalities become bands of half the constraint tolerance (Ipopt
/// demands degrees of freedom).
///
/// The result is Ipopt's last point if it converged to a feasible one, else the best point of all evaluations. Points
/// with non-finite terms are refused to Ipopt, which then shortens its step.
///
/// MUMPS allows one solve per process at a time: solves of all instances are serialised by a lock, and the stop check
/// is not asked while waiting for it. Exceptions of terms and of the stop check pass through Solve, never through
/// Ipopt.
class IpoptSolver : public Solver {
 public:
  /// Options as checked by Method::Validate; not looked at again.
  explicit IpoptSolver(const IpoptOptions& options) : options_(options) {}

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;

 private:
  QuietIpopt::End SolveRound(Eigen::VectorXd& x, int round, const SolverContext& context);
  SolveStatus RunRounds(Eigen::VectorXd& x, const SolverContext& context);
  SolveStatus Verdict(QuietIpopt::End end) const;
  bool Satisfied(const ObjectiveValue& value) const { return value.max_violation < options_.constraint_tolerance; }

  IpoptOptions options_;
  SlottedProgram slotted_;
  ObjectiveValue value_;  ///< at x of the last round's end
  int iterations_ = 0;
  std::optional<SolveStatus> stop_status_;  ///< what the stop check said
  std::vector<double> scratch_;
};

}  // namespace legopt
