#include "legopt/solvers/internal/chomp_solver.h"

#include <algorithm>
#include <cmath>

namespace legopt {

void ChompSolver::Prepare(Program& program) {
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  for (auto* v : {&lower_, &upper_, &gradient_, &direction_, &step_, &shift_}) v->setZero(tangent);
  point_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
  projection_.Reset(program);
  objective_.Reset(program, options_.sharpness);
  gradients_.Reset(program);
  models_.resize(program.terms().size());
  free_terms_.assign(program.terms().size(), 1);
  for (size_t k = 0; k < free_terms_.size(); ++k) {
    if (EqualityProjection::Holds(program.terms()[k]->shape())) free_terms_[k] = 0;
  }
  metric_.Reset(program.num_waypoints(), program.tangent_size(), options_.metric.smoothness, Differences::kVelocities,
                FirstWaypointIsFixed(program));
}

void ChompSolver::Restart(Program&) {
  objective_.set_penalty(penalty());
  is_current_ = false;
  alpha_ = 0.0;
}

PenaltySolver::EpochEnd ChompSolver::Epoch(Program& program, Eigen::VectorXd& x) {
  if (!NextIteration()) return EpochEnd::kInterrupted;
  if (!is_current_) LinearizeAt(program, x);
  program.StepBounds(x, lower_, upper_);
  Aim(program, x);
  const bool moved = Step(program, x);
  const ObjectiveValue value = EvaluateObjective(program, x, residuals_);
  Visit(x, value);
  return moved ? EpochEnd::kDone : EpochEnd::kStuck;
}

void ChompSolver::LinearizeAt(Program& program, Eigen::VectorXd& x) {
  program.StepBounds(x, lower_, upper_);
  shift_.setZero();
  projection_.Project(program, x, lower_, upper_, shift_, point_);
  if (point_.allFinite()) x = point_;
  value_ = objective_.ValueAndGradients(x, free_terms_, gradients_, models_);
  gradients_.Sum(program, free_terms_, gradient_);
  is_current_ = true;
}

void ChompSolver::Aim(Program& program, const Eigen::VectorXd& x) {
  for (Eigen::Index i = 0; i < gradient_.size(); ++i) {
    const bool held = gradient_[i] > 0.0 ? lower_[i] >= 0.0 : upper_[i] <= 0.0;
    direction_[i] = held ? 0.0 : gradient_[i];
  }
  metric_.ApplyInverse(direction_);
  projection_.Linearize(program, x, lower_, upper_, metric_);
  projection_.MakeTangent(direction_);
}

double ChompSolver::FirstAlpha() const {
  if (!(alpha_ > 0.0)) return 1.0;
  constexpr double kMaxChange = 10.0;
  const double bend = gradient_.dot(step_) - slope_;  // dx^T dg of the last step
  if (!(bend > 0.0)) return kMaxChange * alpha_;
  return alpha_ * std::clamp(-slope_ / bend, 1.0 / kMaxChange, kMaxChange);
}

bool ChompSolver::Step(Program& program, Eigen::VectorXd& x) {
  const double longest = direction_.cwiseAbs().maxCoeff();
  if (!std::isfinite(value_) || !(longest > 0.0)) return false;
  double alpha = std::min(FirstAlpha(), options_.max_step / longest);
  for (int k = 0; k < options_.max_trials; ++k, alpha *= 0.5) {
    step_ = (-alpha * direction_).cwiseMax(lower_).cwiseMin(upper_);
    projection_.Project(program, x, lower_, upper_, step_, point_);
    const double slope = gradient_.dot(step_);
    const double value = objective_.Value(point_, free_terms_);
    if (!(value < value_) || value > value_ + options_.sufficient_decrease * slope) continue;
    alpha_ = alpha;
    slope_ = slope;
    x = point_;
    is_current_ = false;
    return true;
  }
  return false;
}

}  // namespace legopt
