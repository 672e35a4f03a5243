#pragma once

#include <Eigen/Core>
#include <memory>

#include "legopt/optimize/gradient_direction.h"
#include "legopt/optimize/gradient_options.h"
#include "legopt/optimize/penalty_solver.h"
#include "legopt/optimize/projected_line.h"
#include "legopt/optimize/sampling.h"
#include "legopt/optimize/smooth_objective.h"
#include "legopt/optimize/term_sampler.h"

namespace legopt {

/// Gradient descent on the smoothed penalty objective (paper, (13) to (22)),
///     x_{k+1} = P_C(x_k - alpha_k d_k),
/// in the tangent space of the program, with d_k by a GradientDirection and alpha_k by Wolfe's strong conditions.
///
/// Each iteration refreshes the gradients of a mini-batch (docs/readings.md#terms-and-samples). **Stochastic** (sample
/// below 100 %): direction and line search see the batch only. **Incremental**: the direction uses the sum of the last
/// gradients of all terms (all are fresh at the first iteration of a mu), the line search the full sum. Where the line
/// search finds no Wolfe point, the lowest point of sufficient decrease is taken, or the short step if that is longer
/// (docs/readings.md#line-search). Where d_k does not descend, x stays and the next batch follows: moments keep turning
/// towards the gradient.
class GradientSolver : public PenaltySolver {
 public:
  /// `direction` makes d_k of g_k and belongs to the solver; `sampling` says which terms an iteration looks at.
  GradientSolver(const GradientOptions& options, std::unique_ptr<GradientDirection> direction,
                 const Sampling& sampling);

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  bool searches_all() const { return sampling_.incremental || sampler_.everything(); }
  /// Smoothed value and gradients of the terms of `mask` at x.
  void LookAt(Program& program, const Eigen::VectorXd& x, const TermMask& mask);
  /// The gradient that the direction is made of.
  const Eigen::VectorXd& SampledGradient(const Program& program, const TermMask& batch);
  /// A search along line_; true when x moved.
  bool Step(Eigen::VectorXd& x);

  GradientOptions options_;
  Sampling sampling_;
  std::unique_ptr<GradientDirection> direction_rule_;
  TermSampler sampler_;
  TermMask all_;
  SmoothObjective objective_;
  ProjectedLine line_;
  TermGradients at_x_;    ///< of the terms that the line search sees
  TermGradients memory_;  ///< incremental: of all terms, each at the x of its last refresh
  bool filled_ = false;   ///< memory_ has all terms
  bool looked_ = false;   ///< the following are of all terms at x
  double value_ = 0.0;    ///< smoothed
  ObjectiveValue exact_;
  Eigen::VectorXd gradient_, memory_sum_, sampled_, direction_;
  double last_alpha_ = 0.0;  ///< 0: none yet
  std::vector<double> scratch_;
};

}  // namespace legopt
