#include "legopt/solvers/internal/sqp_solver.h"

#include <algorithm>
#include <cmath>

#include "legopt/solvers/subproblem/interior_point.h"
#include "legopt/solvers/subproblem/ipopt_subproblem.h"

namespace legopt {
namespace {

// The subproblem must be solved well enough for the convergence test on the predicted decrease to mean something.
constexpr double kSubproblemShare = 0.05;    // share of min_approx_improve
constexpr double kGoodShare = 0.75;          // share of the predicted decrease from which on the model counts as good
constexpr double kReachedShare = 0.99;       // share of the trust box from which on a step counts as cut by it
constexpr double kTrustRestartFactor = 1.5;  // TrajOpt: s is at least 1.5 min / shrink after a penalty increase

std::unique_ptr<SubproblemSolver> MakeSubproblemSolver(SubproblemMethod method) {
  if (method == SubproblemMethod::kIpopt) return std::make_unique<IpoptSubproblemSolver>();
  return std::make_unique<InteriorPointSolver>();
}

}  // namespace

SqpSolver::SqpSolver(const SqpOptions& options, const Sampling& sampling)
    : options_(options), sampling_(sampling), subproblem_solver_(MakeSubproblemSolver(options.subproblem)) {}

void SqpSolver::Prepare(const Program& program) {
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  if (subproblem_ == nullptr || subproblem_->num_blocks() != program.num_waypoints() ||
      subproblem_->block_size() != program.tangent_size()) {
    subproblem_ = std::make_unique<ConvexSubproblem>(program.num_waypoints(), program.tangent_size());
  }
  sampler_.Reset(program, sampling_);
  models_.resize(program.terms().size());
  for (auto* v : {&zero_, &dx_, &lower_, &upper_}) v->setZero(tangent);
  x_trial_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
  trust_box_ = options_.trust_box_size;
  penalty_ = options_.initial_penalty;
  iterations_ = 0;
  stop_status_.reset();
}

SolverResult SqpSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  Prepare(program);
  context_ = &context;
  SolverResult result;
  program.ClearCache();
  program.ProjectOnBounds(x);
  value_ = EvaluateObjective(program, x, scratch_);
  at_x_ = true;
  if (!value_.IsFinite()) {
    result.status = SolveStatus::kNumericalFailure;
    result.value = value_;
    return result;
  }
  InnerEnd end = InnerEnd::kConverged;
  for (int k = 0; k < options_.max_penalty_iterations; ++k) {
    end = ConvexifyLoop(program, x);
    if (end == InnerEnd::kStopped || end == InnerEnd::kFailed || Satisfied()) break;
    penalty_ *= options_.penalty_increase_ratio;
    trust_box_ = std::max(trust_box_, RestartedTrustBox());
  }
  result.status = StatusAfter(end);
  result.value = value_;
  result.feasible = Satisfied();
  result.iterations = iterations_;
  return result;
}

bool SqpSolver::StopsWhenFeasible() const {
  if (options_.stop_when_feasible == FeasibleStop::kIncremental) return sampling_.incremental;
  return options_.stop_when_feasible == FeasibleStop::kAlways;
}

double SqpSolver::RestartedTrustBox() const {
  return kTrustRestartFactor * options_.min_trust_box_size / options_.trust_shrink_ratio;
}

SolveStatus SqpSolver::StatusAfter(InnerEnd end) const {
  switch (end) {
    case InnerEnd::kStopped:
      return *stop_status_;
    case InnerEnd::kFailed:
      return SolveStatus::kNumericalFailure;
    case InnerEnd::kIterationLimit:
      return SolveStatus::kIterationLimit;
    case InnerEnd::kConverged:
      break;
  }
  return Satisfied() ? SolveStatus::kConvergedFeasible : SolveStatus::kConvergedInfeasible;
}

SqpSolver::InnerEnd SqpSolver::ConvexifyLoop(Program& program, Eigen::VectorXd& x) {
  bool refresh_all = sampling_.incremental;
  for (int k = 0; k < options_.max_iterations; ++k) {
    Convexify(program, x, refresh_all);
    refresh_all = false;
    switch (TrustRegionLoop(program, x)) {
      case StepEnd::kAccepted:
        if (StopsWhenFeasible() && Satisfied()) return InnerEnd::kConverged;
        break;
      case StepEnd::kConverged:
        if (!sampling_.incremental || fresh_) return InnerEnd::kConverged;
        refresh_all = true;
        trust_box_ = std::max(trust_box_, RestartedTrustBox());
        break;
      case StepEnd::kStopped:
        return InnerEnd::kStopped;
      case StepEnd::kFailed:
        return InnerEnd::kFailed;
    }
  }
  return InnerEnd::kIterationLimit;
}

void SqpSolver::Convexify(Program& program, const Eigen::VectorXd& x, bool refresh_all) {
  if (!at_x_) program.SetPoint(x);
  at_x_ = true;
  const auto& terms = program.terms();
  const bool all = refresh_all || sampler_.everything();
  const std::vector<std::uint8_t>& drawn = all ? sampler_.All() : sampler_.Draw(context_->rng());
  for (size_t k = 0; k < terms.size(); ++k) {
    if (drawn[k] != 0) terms[k]->Linearize(models_[k]);
  }
  in_subproblem_ = drawn;
  if (sampling_.incremental) in_subproblem_.assign(terms.size(), 1);
  fresh_ = all;
  BuildSubproblem(program);
}

void SqpSolver::BuildSubproblem(const Program& program) {
  subproblem_->Clear();
  const auto& terms = program.terms();
  for (size_t k = 0; k < terms.size(); ++k) {
    if (in_subproblem_[k] == 0) continue;
    const TermShape& shape = terms[k]->shape();
    if (shape.kind == TermKind::kCost) {
      subproblem_->AddCost(shape.waypoint, models_[k]);
    } else {
      const double weight = shape.kind == TermKind::kPreference ? shape.weight : penalty_;
      subproblem_->AddPenalties(shape.waypoint, models_[k], shape.kind, weight);
    }
  }
}

bool SqpSolver::SolveSubproblem(const Program& program, const Eigen::VectorXd& x) {
  program.StepBounds(x, lower_, upper_);
  lower_ = lower_.cwiseMax(-trust_box_);
  upper_ = upper_.cwiseMin(trust_box_);
  subproblem_->SetBounds(lower_, upper_);
  ++iterations_;
  const double merit = value_.Merit(penalty_);
  const SubproblemSolver::Accuracy accuracy = {
      .gap = std::max(kSubproblemShare * options_.min_approx_improve, options_.subproblem_accuracy_frac * merit),
      // Once the constraints hold, the last steps decide the cost.
      .share = Satisfied() ? 1.0 : options_.subproblem_decrease_share,
      .negligible = std::max(options_.min_approx_improve, options_.min_approx_improve_frac * merit)};
  return subproblem_solver_->Solve(*subproblem_, accuracy, dx_).status != SubproblemSolver::Status::kFailed;
}

SqpSolver::StepEnd SqpSolver::TrustRegionLoop(Program& program, Eigen::VectorXd& x) {
  const double model = subproblem_->Value(zero_);  // equals the merit, unless terms are stale or missing
  while (trust_box_ >= options_.min_trust_box_size) {
    stop_status_ = context_->Stopped();
    if (stop_status_) return StepEnd::kStopped;
    if (!SolveSubproblem(program, x)) return StepEnd::kFailed;
    const double predicted = model - subproblem_->Value(dx_);
    if (TooSmall(predicted)) return StepEnd::kConverged;
    const Step step = TryStep(program, x, predicted);
    ResizeTrustBox(step);
    if (step == Step::kRejected) continue;
    x.swap(x_trial_);
    at_x_ = true;
    if (sampling_.incremental) ShiftModels(program, dx_, models_);
    return StepEnd::kAccepted;
  }
  return StepEnd::kConverged;
}

bool SqpSolver::TooSmall(double predicted) const {
  const double merit = value_.Merit(penalty_);
  if (predicted < options_.min_approx_improve || predicted < options_.min_approx_improve_frac * merit) return true;
  if (options_.polish_violations || !Satisfied()) return false;
  return predicted - penalty_ * value_.violation < options_.min_approx_improve_frac * value_.Objective();
}

SqpSolver::Step SqpSolver::TryStep(Program& program, const Eigen::VectorXd& x, double predicted) {
  const double merit = value_.Merit(penalty_);
  program.Retract(x, dx_, x_trial_);
  const ObjectiveValue trial = EvaluateObjective(program, x_trial_, scratch_);
  at_x_ = false;
  const double actual = merit - trial.Merit(penalty_);
  const bool accepted = trial.IsFinite() && actual >= 0.0 && actual >= options_.improve_ratio_threshold * predicted;
  context_->Record({.penalty = penalty_,
                    .trust_box = trust_box_,
                    .cost = trial.cost,
                    .violation = trial.max_violation,
                    .accepted = accepted});
  if (!accepted) return Step::kRejected;
  value_ = trial;
  return actual > kGoodShare * predicted ? Step::kGood : Step::kAccepted;
}

void SqpSolver::ResizeTrustBox(Step step) {
  const bool accepted = step != Step::kRejected;
  if (options_.trust_rule == TrustRule::kTrajOpt) {
    trust_box_ *= accepted ? options_.trust_expand_ratio : options_.trust_shrink_ratio;
    return;
  }
  const double length = dx_.lpNorm<Eigen::Infinity>();
  if (!accepted) {
    trust_box_ = options_.trust_shrink_ratio * std::min(trust_box_, length);
  } else if (step == Step::kGood && length > kReachedShare * trust_box_) {
    trust_box_ *= options_.trust_expand_ratio;
  }
}

}  // namespace legopt
