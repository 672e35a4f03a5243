#include "legopt/solvers/ipopt_solver.h"

#include "legopt/solvers/ipopt_round.h"

namespace legopt {
namespace {

constexpr double kProgress = 0.9;  // a failed round that reduces the violation below this share is followed by another

}  // namespace

SolverResult IpoptSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  SolverResult result;
  program.ClearCache();
  program.ProjectOnBounds(x);
  value_ = EvaluateObjective(program, x, scratch_);
  if (!value_.IsFinite()) {
    result.status = SolveStatus::kNumericalFailure;
    result.value = value_;
    return result;
  }
  const size_t first_record = NumRecords(context);
  slotted_.Reset(program);
  iterations_ = 0;
  result.status = RunRounds(x, context);
  result.value = EvaluateObjective(program, x, scratch_);
  result.feasible = Satisfied(result.value);
  result.iterations = iterations_;
  CloseHistory(context, first_record, result.value);
  return result;
}

SolveStatus IpoptSolver::RunRounds(Eigen::VectorXd& x, const SolverContext& context) {
  stop_status_ = context.Stopped();
  if (stop_status_) return *stop_status_;
  slotted_.Rebase(x);
  QuietIpopt::End end = QuietIpopt::End::kIterationLimit;
  for (int round = 0; round < options_.max_rounds; ++round) {
    const double violation = value_.max_violation;
    end = SolveRound(x, round, context);
    if (end == QuietIpopt::End::kStopped || end == QuietIpopt::End::kIterationLimit) break;
    if (end == QuietIpopt::End::kSolved && !slotted_.SharedSlotActive(options_.constraint_tolerance)) break;
    const bool grown = slotted_.Rebase(x);
    const bool closer = !Satisfied(value_) && value_.max_violation < kProgress * violation;
    if (!grown && !closer) break;
  }
  return Verdict(end);
}

QuietIpopt::End IpoptSolver::SolveRound(Eigen::VectorXd& x, int round, const SolverContext& context) {
  const int iterations_left = options_.max_iterations - iterations_;
  if (iterations_left <= 0) return QuietIpopt::End::kIterationLimit;
  const IpoptRound made = SolveByIpopt(slotted_, context, options_, round, iterations_left);
  iterations_ += made.iterations;
  const bool solved = made.end == QuietIpopt::End::kSolved;
  if (solved && slotted_.Evaluate(made.last_dx.data()) && Satisfied(slotted_.value())) {
    x = slotted_.x();
    value_ = slotted_.value();
    return made.end;
  }
  x = made.best_x;
  value_ = made.best_value;
  stop_status_ = made.stop_status;
  return solved ? QuietIpopt::End::kFailed : made.end;
}

SolveStatus IpoptSolver::Verdict(QuietIpopt::End end) const {
  switch (end) {
    case QuietIpopt::End::kStopped:
      return *stop_status_;
    case QuietIpopt::End::kSolved:
      return SolveStatus::kConvergedFeasible;
    case QuietIpopt::End::kNoProgress:
      // A feasible point where Ipopt got stuck is not an optimum.
      return Satisfied(value_) ? SolveStatus::kIterationLimit : SolveStatus::kConvergedInfeasible;
    case QuietIpopt::End::kIterationLimit:
      return SolveStatus::kIterationLimit;
    case QuietIpopt::End::kFailed:
      break;
  }
  return Satisfied(value_) ? SolveStatus::kIterationLimit : SolveStatus::kNumericalFailure;
}

}  // namespace legopt
