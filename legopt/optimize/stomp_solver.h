#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/optimize/penalty_solver.h"
#include "legopt/optimize/stomp_options.h"
#include "legopt/optimize/waypoint_metric.h"
#include "legopt/random_draws.h"

namespace legopt {

/// Stochastic trajectory optimisation after STOMP (Kalakrishnan et al., ICRA 2011), on the exact penalty objective
/// F + mu V; needs no derivatives. Each iteration tries `rollouts` noisy copies x + e_k, e_k of covariance
/// noise^2 A^-1 (waypoint_metric.h), clipped to the bounds, and weighs them waypoint by waypoint,
///
///     P_kt = exp(-h (S_kt - min_k S_kt) / (max_k S_kt - min_k S_kt)) / (sum over k),   dx = A^-1 sum_k P_kt e_kt,
///
/// with S_kt the objective of the terms that touch waypoint t at rollout k. Unlike in the original, which takes every
/// update, x moves only where the objective falls - to the update or the best rollout, whichever is lower - and the
/// noise grows or shrinks with success: the tolerances of contacts lie two orders below a useful first noise.
class StompSolver : public PenaltySolver {
 public:
  /// Options as checked by Method::Validate; not looked at again.
  explicit StompSolver(const StompOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Draws and evaluates all rollouts around x; keeps the best in best_point_ and best_value_.
  void RollOut(Program& program, const Eigen::VectorXd& x);
  /// Exact value at point_, and the share of every waypoint in column `rollout` of local_costs_.
  ObjectiveValue Evaluate(Program& program, int rollout);
  /// step_ = the weighted update.
  void Combine(const Program& program);

  StompOptions options_;
  WaypointMetric metric_;
  NormalDraws normal_;
  double noise_ = 0.0;
  ObjectiveValue value_;                   ///< at x
  bool known_ = false;                     ///< value_ is
  std::vector<Eigen::VectorXd> rollouts_;  ///< e_k
  Eigen::MatrixXd local_costs_;            ///< S_kt: waypoints x rollouts
  Eigen::VectorXd lower_, upper_, step_, weights_, point_, best_point_;
  ObjectiveValue best_value_;
  std::vector<double> residuals_;
};

}  // namespace legopt
