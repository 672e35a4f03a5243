#include "legopt/optimize/stomp_solver.h"

#include <cmath>
#include <limits>

namespace legopt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Merit that orders points with terms that are not finite last.
double OrderedMerit(const ObjectiveValue& value, double penalty) {
  return value.IsFinite() ? value.Merit(penalty) : kInfinity;
}

}  // namespace

void StompSolver::Prepare(Program& program) {
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  metric_.Reset(program.num_waypoints(), program.tangent_size(), options_.metric);
  rollouts_.resize(static_cast<size_t>(options_.rollouts));
  for (Eigen::VectorXd& noise : rollouts_) noise.setZero(tangent);
  for (auto* v : {&lower_, &upper_, &step_}) v->setZero(tangent);
  point_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
  best_point_ = point_;
  local_costs_.setZero(program.num_waypoints(), options_.rollouts);
  weights_.setZero(options_.rollouts);
  normal_.Reset();
}

void StompSolver::Restart(Program&) {
  noise_ = options_.noise;
  known_ = false;
}

PenaltySolver::EpochEnd StompSolver::Epoch(Program& program, Eigen::VectorXd& x) {
  if (!NextIteration()) return EpochEnd::kInterrupted;
  if (!known_) value_ = EvaluateObjective(program, x, residuals_);
  known_ = true;
  program.StepBounds(x, lower_, upper_);
  RollOut(program, x);
  Combine(program);
  program.Retract(x, step_, point_);
  const ObjectiveValue updated = EvaluateObjective(program, point_, residuals_);
  if (OrderedMerit(updated, penalty()) <= OrderedMerit(best_value_, penalty())) {
    best_point_.swap(point_);
    best_value_ = updated;
  }
  const bool lower = OrderedMerit(best_value_, penalty()) < value_.Merit(penalty());
  if (lower) {
    x = best_point_;
    value_ = best_value_;
  }
  noise_ *= lower ? options_.noise_growth : options_.noise_shrinkage;
  Visit(x, value_);
  return EpochEnd::kDone;
}

void StompSolver::RollOut(Program& program, const Eigen::VectorXd& x) {
  best_value_.cost = kInfinity;
  for (int k = 0; k < options_.rollouts; ++k) {
    Eigen::VectorXd& noise = rollouts_[static_cast<size_t>(k)];
    for (double& entry : noise) entry = normal_.Next(context().Draws());
    metric_.Correlate(noise);
    noise = (noise_ * noise).cwiseMax(lower_).cwiseMin(upper_);
    program.Retract(x, noise, point_);
    const ObjectiveValue value = Evaluate(program, k);
    if (OrderedMerit(value, penalty()) < OrderedMerit(best_value_, penalty())) {
      best_point_.swap(point_);
      best_value_ = value;
    }
  }
}

ObjectiveValue StompSolver::Evaluate(Program& program, int rollout) {
  program.SetPoint(point_);
  ObjectiveValue value;
  auto local = local_costs_.col(rollout);
  local.setZero();
  const auto& terms = program.terms();
  for (size_t k = 0; k < terms.size(); ++k) {
    residuals_.clear();
    terms[k]->Evaluate(residuals_);
    const TermShape& shape = terms[k]->shape();
    ObjectiveValue share;
    share.Add(shape, static_cast<int>(k), residuals_);
    value.Add(shape, static_cast<int>(k), residuals_);
    local.segment(shape.waypoint, shape.num_waypoints).array() += OrderedMerit(share, penalty());
  }
  return value;
}

void StompSolver::Combine(const Program& program) {
  step_.setZero();
  const Eigen::Index size = program.tangent_size();
  for (Eigen::Index t = 0; t < program.num_waypoints(); ++t) {
    const auto costs = local_costs_.row(t);
    const double least = costs.minCoeff();
    double most = least;
    for (const double cost : costs) most = std::isfinite(cost) && cost > most ? cost : most;
    if (!(most > least)) continue;  // nothing to tell the rollouts apart, or none is finite
    for (int k = 0; k < options_.rollouts; ++k) {
      weights_[k] = std::exp(-options_.selectivity * (costs[k] - least) / (most - least));
    }
    weights_ /= weights_.sum();
    for (int k = 0; k < options_.rollouts; ++k) {
      step_.segment(t * size, size) += weights_[k] * rollouts_[static_cast<size_t>(k)].segment(t * size, size);
    }
  }
  metric_.ApplyInverse(step_);
  step_ = step_.cwiseMax(lower_).cwiseMin(upper_);
}

}  // namespace legopt
