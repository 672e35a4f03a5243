#include "legopt/solvers/internal/stomp_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace legopt {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Merit for sorting: points with non-finite terms come last.
double OrderedMerit(const ObjectiveValue& value, double penalty) {
  return value.IsFinite() ? value.Merit(penalty) : kInfinity;
}

}  // namespace

void StompSolver::Prepare(Program& program) {
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  projection_.Reset(program);
  rollouts_.resize(static_cast<size_t>(options_.rollouts));
  for (Eigen::VectorXd& noise : rollouts_) noise.setZero(tangent);
  for (auto* v : {&lower_, &upper_, &step_}) v->setZero(tangent);
  point_.setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
  local_costs_.setZero(program.num_waypoints(), options_.rollouts);
  weights_.setZero(options_.rollouts);
  normal_.Reset();
  noise_ = options_.noise;
  metric_.Reset(program.num_waypoints(), program.tangent_size(), options_.metric.smoothness,
                Differences::kAccelerations, FirstWaypointIsFixed(program));
}

void StompSolver::Restart(Program&) { known_ = false; }

PenaltySolver::EpochEnd StompSolver::Epoch(Program& program, Eigen::VectorXd& x) {
  if (!NextIteration()) return EpochEnd::kInterrupted;
  if (!known_) value_ = EvaluateObjective(program, x, residuals_);
  known_ = true;
  program.StepBounds(x, lower_, upper_);
  RollOut(program, x);
  Combine(program);
  projection_.Project(program, x, lower_, upper_, step_, point_);
  const ObjectiveValue updated = EvaluateObjective(program, point_, residuals_);
  const bool lower = OrderedMerit(updated, penalty()) < value_.Merit(penalty());
  if (updated.IsFinite()) {
    x.swap(point_);
    value_ = updated;
  }
  noise_ *= lower ? options_.noise_growth : options_.noise_shrinkage;
  noise_ = std::clamp(noise_, std::min(options_.noise_floor, options_.noise), options_.noise);
  Visit(x, value_);
  return EpochEnd::kDone;
}

void StompSolver::RollOut(Program& program, const Eigen::VectorXd& x) {
  for (int k = 0; k < options_.rollouts; ++k) {
    Eigen::VectorXd& noise = rollouts_[static_cast<size_t>(k)];
    for (double& entry : noise) entry = normal_.Next(context().rng());
    metric_.Correlate(noise);
    noise = (noise_ * noise).cwiseMax(lower_).cwiseMin(upper_);
    projection_.Project(program, x, lower_, upper_, noise, point_);
    Evaluate(program, k);
  }
}

void StompSolver::Evaluate(Program& program, int rollout) {
  program.SetPoint(point_);
  auto local = local_costs_.col(rollout);
  local.setZero();
  const auto& terms = program.terms();
  for (size_t k = 0; k < terms.size(); ++k) {
    residuals_.clear();
    terms[k]->Evaluate(residuals_);
    const TermShape& shape = terms[k]->shape();
    ObjectiveValue share;
    share.Add(shape, static_cast<int>(k), residuals_);
    local.segment(shape.waypoint, shape.num_waypoints).array() += OrderedMerit(share, penalty());
  }
}

void StompSolver::Combine(const Program& program) {
  step_.setZero();
  const Eigen::Index size = program.tangent_size();
  for (Eigen::Index t = 0; t < program.num_waypoints(); ++t) {
    const auto costs = local_costs_.row(t);
    const double least = costs.minCoeff();
    double most = least;
    for (const double cost : costs) most = std::isfinite(cost) && cost > most ? cost : most;
    if (!(most > least)) continue;  // all rollouts cost the same, or none is finite
    for (int k = 0; k < options_.rollouts; ++k) {
      weights_[k] = std::exp(-options_.selectivity * (costs[k] - least) / (most - least));
    }
    weights_ /= weights_.sum();
    for (int k = 0; k < options_.rollouts; ++k) {
      step_.segment(t * size, size) += weights_[k] * rollouts_[static_cast<size_t>(k)].segment(t * size, size);
    }
  }
  metric_.Smooth(step_);
  step_ = step_.cwiseMax(lower_).cwiseMin(upper_);
}

}  // namespace legopt
