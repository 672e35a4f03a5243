#include "legopt/solvers/internal/penalty_solver.h"

namespace legopt {

SolverResult PenaltySolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  context_ = &context;
  const size_t first_record = NumRecords(context);
  iterations_ = 0;
  stop_status_.reset();
  SolverResult result;
  program.ClearCache();
  program.ProjectOnBounds(x);
  lowest_.Take(x, EvaluateObjective(program, x, scratch_));
  result.value = lowest_.value;
  if (!lowest_.value.IsFinite()) {
    result.status = SolveStatus::kNumericalFailure;
    return result;
  }
  Prepare(program);
  best_ = lowest_;
  penalty_ = options_.initial_penalty;
  InnerEnd end = InnerEnd::kConverged;
  for (int k = 0; k < options_.max_penalty_iterations; ++k) {
    end = MinimizeAtPenalty(program);
    if (end == InnerEnd::kStopped || Satisfied(lowest_.value)) break;
    penalty_ *= options_.penalty_increase_ratio;
  }
  x = best_.x;
  result.value = best_.value;
  CloseHistory(context, first_record, result.value);
  result.feasible = Satisfied(best_.value);
  result.iterations = iterations_;
  if (end == InnerEnd::kStopped) {
    result.status = *stop_status_;
  } else if (end == InnerEnd::kIterationLimit) {
    result.status = SolveStatus::kIterationLimit;
  } else {
    result.status = result.feasible ? SolveStatus::kConvergedFeasible : SolveStatus::kConvergedInfeasible;
  }
  return result;
}

PenaltySolver::InnerEnd PenaltySolver::MinimizeAtPenalty(Program& program) {
  x_ = lowest_.x;
  Restart(program);
  double reference = lowest_.value.Merit(penalty_);
  int epochs = 0, idle_epochs = 0;
  while (idle_epochs < MaxIdleEpochs()) {
    if (epochs++ >= options_.max_epochs) return InnerEnd::kIterationLimit;
    finite_ = true;
    const EpochEnd end = Epoch(program, x_);
    if (stop_status_) return InnerEnd::kStopped;
    const double merit = lowest_.value.Merit(penalty_);
    const bool improved = merit < (1.0 - options_.min_improve_frac) * reference;
    if (end == EpochEnd::kStuck) break;
    idle_epochs = improved ? 0 : idle_epochs + 1;
    if (improved) reference = merit;
    if (!finite_) {
      x_ = lowest_.x;
      Restart(program);
    }
  }
  return InnerEnd::kConverged;
}

int PenaltySolver::MaxIdleEpochs() const {
  return Satisfied(lowest_.value) ? options_.max_epochs_when_satisfied : options_.max_epochs_without_improvement;
}

bool PenaltySolver::NextIteration() {
  if (!stop_status_) stop_status_ = context_->Stopped();
  if (stop_status_) return false;
  ++iterations_;
  return true;
}

bool PenaltySolver::Visit(const Eigen::VectorXd& x, const ObjectiveValue& value) {
  finite_ = value.IsFinite();
  const bool lowest = finite_ && value.Merit(penalty_) < lowest_.value.Merit(penalty_);
  if (lowest) lowest_.Take(x, value);
  if (finite_ && Better(value, best_.value)) best_.Take(x, value);
  context_->Record({.penalty = penalty_, .cost = value.cost, .violation = value.max_violation, .accepted = lowest});
  return finite_;
}

bool PenaltySolver::Better(const ObjectiveValue& a, const ObjectiveValue& b) const {
  if (Satisfied(a) != Satisfied(b)) return Satisfied(a);
  return Satisfied(a) ? a.Objective() < b.Objective() : a.max_violation < b.max_violation;
}

}  // namespace legopt
