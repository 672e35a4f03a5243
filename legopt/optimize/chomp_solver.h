#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/optimize/chomp_options.h"
#include "legopt/optimize/equality_projection.h"
#include "legopt/optimize/penalty_solver.h"
#include "legopt/optimize/smooth_objective.h"
#include "legopt/optimize/waypoint_metric.h"

namespace legopt {

/// Covariant gradient descent after CHOMP (Ratliff, Zucker, Bagnell, Srinivasa, ICRA 2009; with constraints: Zucker et
/// al., IJRR 2013), on the smoothed penalty objective of the paper without the terms that are projected upon:
///
///     dx = P(-alpha T A^-1 g),   A = I + smoothness K^T K of velocities (waypoint_metric.h),
///
/// with T onto the tangents of the contacts in the metric A, and P onto the contacts (equality_projection.h). alpha is
/// that of Barzilai and Borwein (IMA J. Numer. Anal. 1988) in this metric, dx^T A dx / dx^T dg of the last step, halved
/// until Armijo's condition holds for the step that is really made; the original's is constant. Obstacles are the
/// benchmark's collision terms, not the original's integral along the path of points of the body.
class ChompSolver : public PenaltySolver {
 public:
  /// Options as checked by Method::Validate; not looked at again.
  explicit ChompSolver(const ChompOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Value and gradient at x, which is moved onto the contacts where that can be.
  void LookAt(Program& program, Eigen::VectorXd& x);
  /// direction_ = T A^-1 g, without what of g pushes against a bound.
  void Aim(Program& program, const Eigen::VectorXd& x);
  /// Step length to begin with.
  double FirstAlpha() const;
  /// Moves x; false when no step pays.
  bool Step(Program& program, Eigen::VectorXd& x);

  ChompOptions options_;
  WaypointMetric metric_;
  EqualityProjection projection_;
  SmoothObjective objective_;
  TermMask free_terms_;  ///< those that are not projected upon
  TermGradients gradients_;
  TermModels models_;
  double value_ = 0.0;   ///< of the free terms at x
  double alpha_ = 0.0;   ///< last step length; 0: none yet
  double slope_ = 0.0;   ///< g^T dx of the last step
  bool looked_ = false;  ///< value_ and gradient_ are those of x
  Eigen::VectorXd lower_, upper_, gradient_, direction_, step_, shift_, point_;
  std::vector<double> residuals_;
};

}  // namespace legopt
