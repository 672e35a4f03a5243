#pragma once

#include <Eigen/Core>
#include <optional>

#include "legopt/solvers/internal/slotted_program.h"
#include "legopt/solvers/ipopt_options.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/subproblem/ipopt_subproblem.h"

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

/// Baseline: the whole problem as one nonlinear program by Ipopt (interior point, filter line search, MUMPS):
///
///     min F(x)   subject to   h(x) = 0,   g(x) <= 0,   bounds of x.
///
/// Variables are dx about a base point; rows that appear and disappear get slots. The feasible set of the program in
/// slots is exactly the original one (see SlottedProgram). Ipopt solves a sequence of such programs ("rounds"),
/// each from the end of the previous one. Another round follows if the last one converged while rows without a slot of
/// their own were active. It also follows if the last one failed but found such rows or came closer to feasibility. The
/// new round has slots for all rows at its base point. Most problems need one round.
///
/// Second derivatives: Gauss-Newton for the costs plus a damping of the diagonal, none for the constraints; or Ipopt's
/// limited-memory BFGS of both. If there are more equality rows than free variables, equalities become bands of plus
/// and minus half the constraint tolerance (Ipopt requires degrees of freedom).
///
/// The result is Ipopt's last point if it converged to a feasible one, else the best point of all evaluations. Points
/// with non-finite terms are rejected, and Ipopt then shortens its step.
///
/// MUMPS allows one solve per process at a time: a lock serialises the solves of all instances, and the stop check is
/// not called while waiting for it. Exceptions of terms and of the stop check leave Solve without passing through
/// Ipopt.
class IpoptSolver : public Solver {
 public:
  /// `options` must have passed Method::Validate.
  explicit IpoptSolver(const IpoptOptions& options) : options_(options) {}

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;

 private:
  QuietIpopt::End SolveRound(Eigen::VectorXd& x, int round, const SolverContext& context);
  SolveStatus RunRounds(Eigen::VectorXd& x, const SolverContext& context);
  SolveStatus Verdict(QuietIpopt::End end) const;
  bool Satisfied(const ObjectiveValue& value) const { return value.max_violation < options_.constraint_tolerance; }

  IpoptOptions options_;
  SlottedProgram slotted_;
  ObjectiveValue value_;  ///< value at the end of the last round
  int iterations_ = 0;
  std::optional<SolveStatus> stop_status_;  ///< last answer of the stop check
  std::vector<double> scratch_;
};

}  // namespace legopt
