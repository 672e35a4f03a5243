#include "legopt/optimize/best_solver.h"

#include <cmath>

#include "legopt/random_draws.h"

namespace legopt {
namespace {

bool Better(const SolverResult& a, const SolverResult& b) {
  if (a.feasible != b.feasible) return a.feasible;
  if (!a.value.IsFinite()) return false;
  return a.feasible ? a.value.Objective() < b.value.Objective() : a.value.max_violation < b.value.max_violation;
}

/// A better start from where no step was worth a try is a step of its own.
void RecordMove(const SolverContext& context, size_t first_record, const ObjectiveValue& from,
                const ObjectiveValue& to) {
  if (NumRecords(context) > first_record) return;
  if (from.cost == to.cost && from.max_violation == to.max_violation) return;
  context.Record({.cost = to.cost, .violation = to.max_violation, .accepted = true});
}

}  // namespace

BestSolver::BestSolver(const BestOptions& options) : options_(options), sqp_(options.sqp) {}

SolverResult BestSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  start_ = x;
  const size_t first_record = NumRecords(context);
  SolverResult best = sqp_.Solve(program, x, context);
  const ObjectiveValue first = best.value;
  if (best.status == SolveStatus::kNumericalFailure && !best.value.IsFinite()) return best;
  for (int k = 0; k < options_.rescues && !best.feasible && !IsStopped(best.status); ++k) {
    Scatter(program, start_, options_.rescue_noise, context.Draws());
    Try(program, context, x, best);
  }
  const int refinements = program.num_waypoints() == 1 && best.feasible ? options_.refinements : 0;
  for (int k = 0; k < refinements && !IsStopped(best.status); ++k) {
    Scatter(program, x, options_.refinement_noise, context.Draws());
    Try(program, context, x, best);
  }
  RecordMove(context, first_record, first, best.value);
  CloseHistory(context, first_record, best.value);
  return best;
}

void BestSolver::Scatter(const Program& program, const Eigen::VectorXd& from, double noise,
                         std::mt19937_64& generator) {
  const Eigen::Index size = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  dx_.setZero(size);
  lower_.resize(size);
  upper_.resize(size);
  trial_.resize(from.size());
  program.StepBounds(from, lower_, upper_);
  for (Eigen::Index i = 0; i < size; ++i) {
    if (std::isfinite(lower_[i]) && std::isfinite(upper_[i]) && lower_[i] < upper_[i]) {
      dx_[i] = noise * (2.0 * UniformDraw(generator) - 1.0);
    }
  }
  program.Retract(from, dx_, trial_);
}

void BestSolver::Try(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best) {
  SolverContext another = context;
  another.start = best.starts;
  SolverResult result = sqp_.Solve(program, trial_, another);
  Effort effort = best;
  effort += result;
  const SolveStatus status = result.status;
  if (Better(result, best)) {
    best = result;
    x.swap(trial_);
  }
  if (IsStopped(status)) best.status = status;
  static_cast<Effort&>(best) = effort;
}

}  // namespace legopt
