#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/solvers/internal/penalty_solver.h"
#include "legopt/solvers/internal/smooth_objective.h"
#include "legopt/solvers/internal/waypoint_metric.h"
#include "legopt/solvers/penalty_options.h"

namespace legopt {

/// Covariant gradient descent after CHOMP (Ratliff, Zucker, Bagnell, Srinivasa, ICRA 2009; with constraints: Zucker et
/// al., IJRR 2013), on the paper's smoothed penalty objective without the terms that are handled by projection:
///
///     dx = P(-alpha T A^-1 g),   A = I + smoothness K^T K.
///
/// A is the velocity metric (waypoint_metric.h), T projects on the tangents of the contacts in this metric, and P
/// projects on the contacts (waypoint_metric.h). alpha starts at the step length of Barzilai and Borwein (IMA J.
/// Numer. Anal. 1988) in this metric, dx^T A dx / dx^T dg of the last step. It is halved until Armijo's condition
/// holds for the projected step; the original uses a constant. Obstacles are the benchmark's collision terms; the
/// original integrates along the paths of body points.
class ChompSolver : public PenaltySolver {
 public:
  /// `options` must have passed Method::Validate.
  explicit ChompSolver(const ChompOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Projects x on the contacts where possible and computes value and gradient there.
  void LinearizeAt(Program& program, Eigen::VectorXd& x);
  /// Sets direction_ = T A^-1 g, without the components of g that push against a bound.
  void Aim(Program& program, const Eigen::VectorXd& x);
  /// Returns the first step length to try.
  double FirstAlpha() const;
  /// Moves x along -direction_. Returns false if no step decreases the objective enough.
  bool Step(Program& program, Eigen::VectorXd& x);

  ChompOptions options_;
  WaypointMetric metric_;
  EqualityProjection projection_;
  SmoothObjective objective_;
  TermMask free_terms_;  ///< terms that are not handled by projection
  TermGradients gradients_;
  TermModels models_;
  double value_ = 0.0;       ///< sum of the free terms at x
  double alpha_ = 0.0;       ///< last step length; 0: none yet
  double slope_ = 0.0;       ///< g^T dx of the last step
  bool is_current_ = false;  ///< value_ and gradient_ are up to date at x
  Eigen::VectorXd lower_, upper_, gradient_, direction_, step_, shift_, point_;
  std::vector<double> residuals_;
};

}  // namespace legopt
