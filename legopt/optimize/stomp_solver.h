#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/optimize/equality_projection.h"
#include "legopt/optimize/penalty_solver.h"
#include "legopt/optimize/stomp_options.h"
#include "legopt/optimize/waypoint_metric.h"
#include "legopt/random_draws.h"

namespace legopt {

/// Stochastic trajectory optimisation, STOMP (Kalakrishnan, Chitta, Theodorou, Pastor, Schaal, ICRA 2011), on the exact
/// penalty objective F + mu V. Costs need no derivatives. Each iteration tries `rollouts` noisy copies x + e_k, with
/// e_k of covariance noise^2 R^-1 along the chain of waypoints (R of accelerations, waypoint_metric.h), moved onto the
/// poses of the contacts (equality_projection.h), and weighs them waypoint by waypoint,
///
///     P_kt = exp(-h (S_kt - min_k S_kt) / (max_k S_kt - min_k S_kt)) / (sum over k),   dx = M sum_k P_kt e_kt,
///
/// with S_kt the objective of the terms that touch waypoint t at rollout k, and M of R^-1 (WaypointMetric::Smooth).
/// Every update is taken, projected again; the lowest point is returned. The noise shrinks with updates that raise the
/// objective and grows with others, over all mu: inequalities must hold to tolerances two orders below a useful first
/// noise, which the original, with a constant noise and costs alone, need not reach.
class StompSolver : public PenaltySolver {
 public:
  /// Options as checked by Method::Validate; not looked at again.
  explicit StompSolver(const StompOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Draws, projects and evaluates all rollouts around x.
  void RollOut(Program& program, const Eigen::VectorXd& x);
  /// The share of every waypoint of the objective at point_, in column `rollout` of local_costs_.
  void Evaluate(Program& program, int rollout);
  /// step_ = the weighted, smoothed update.
  void Combine(const Program& program);

  StompOptions options_;
  WaypointMetric metric_;
  EqualityProjection projection_;
  NormalDraws normal_;
  double noise_ = 0.0;
  ObjectiveValue value_;                   ///< at x
  bool known_ = false;                     ///< value_ is
  std::vector<Eigen::VectorXd> rollouts_;  ///< e_k, projected
  Eigen::MatrixXd local_costs_;            ///< S_kt: waypoints x rollouts
  Eigen::VectorXd lower_, upper_, step_, weights_, point_;
  std::vector<double> residuals_;
};

}  // namespace legopt
