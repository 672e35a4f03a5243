#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/math/random_numbers.h"
#include "legopt/solvers/internal/penalty_solver.h"
#include "legopt/solvers/internal/waypoint_metric.h"
#include "legopt/solvers/penalty_options.h"

namespace legopt {

/// Stochastic trajectory optimisation, STOMP (Kalakrishnan, Chitta, Theodorou, Pastor, Schaal, ICRA 2011), on the exact
/// penalty objective F + mu V. Costs need no derivatives. Each iteration tries `rollouts` noisy copies x + e_k. Here
/// e_k has covariance noise^2 R^-1 along the chain of waypoints (acceleration metric R, waypoint_metric.h) and is moved
/// onto the contact poses (waypoint_metric.h). The copies are weighted waypoint by waypoint,
///
///     P_kt = exp(-h (S_kt - min_k S_kt) / (max_k S_kt - min_k S_kt)) / (sum over k),   dx = M sum_k P_kt e_kt,
///
/// where S_kt is the objective of the terms that touch waypoint t in rollout k, and M is derived from R^-1
/// (WaypointMetric::Smooth). Every update is accepted and projected again; the lowest point is returned. The noise
/// shrinks after updates that raise the objective and grows after the others, across all mu. Inequalities must hold to
/// tolerances two orders of magnitude below a useful initial noise; the original has no such requirement, with its
/// constant noise and costs only.
class StompSolver : public PenaltySolver {
 public:
  /// `options` must have passed Method::Validate.
  explicit StompSolver(const StompOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Generates, projects and evaluates all rollouts around x.
  void RollOut(Program& program, const Eigen::VectorXd& x);
  /// Writes every waypoint's share of the objective at point_ to column `rollout` of local_costs_.
  void Evaluate(Program& program, int rollout);
  /// Sets step_ to the weighted, smoothed update.
  void Combine(const Program& program);

  StompOptions options_;
  WaypointMetric metric_;
  EqualityProjection projection_;
  NormalRandom normal_;
  double noise_ = 0.0;
  ObjectiveValue value_;                   ///< value at x
  bool known_ = false;                     ///< value_ is up to date
  std::vector<Eigen::VectorXd> rollouts_;  ///< e_k, projected
  Eigen::MatrixXd local_costs_;            ///< S_kt: waypoints x rollouts
  Eigen::VectorXd lower_, upper_, step_, weights_, point_;
  std::vector<double> residuals_;
};

}  // namespace legopt
