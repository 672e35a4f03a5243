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
/// Each iteration evaluates the terms of a mini-batch and no others (docs/readings.md#terms-and-samples).
/// **Stochastic** (sample below 100 %): direction and line search see the batch only. **Incremental**: the direction is
/// made of the sum of the last gradients of all terms, of which the batch's are made anew (all of them at the first
/// iteration of a mu); the line search sees the batch, and the other terms by their last linear models, moved along
/// with x as in I-SQP (docs/readings.md#line-search). The exact objective, by which improvement, feasibility and the
/// best point are told, is evaluated once per epoch.
///
/// Where the line search finds no Wolfe point, the lowest point of sufficient decrease is taken, or the short step if
/// that is longer and lower. No step is uphill on what the search sees. Where d_k does not descend, x stays and the
/// next batch follows: moments keep turning towards the gradient.
class GradientSolver : public PenaltySolver {
 public:
  /// `direction` makes d_k of g_k and belongs to the solver; `sampling` says which terms an iteration looks at.
  GradientSolver(const GradientOptions& options, std::unique_ptr<GradientDirection> direction,
                 const Sampling& sampling);

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Directions and searches use what is known of terms that are not in the batch.
  bool remembers_terms() const { return sampling_.incremental && !sampler_.everything(); }
  /// Smoothed value and gradients of the terms of `batch` at x; of all, for the memory, if it has none.
  void LookAt(Program& program, const Eigen::VectorXd& x, const TermMask& batch);
  /// The gradient that the direction is made of: the batch's, or with a memory that of all terms.
  const Eigen::VectorXd& SampledGradient(const Program& program, const TermMask& batch);
  /// A search along line_; true when x moved.
  bool Step(const Program& program, Eigen::VectorXd& x);
  /// The short step where it is longer than what the search found, and lower; else what it found.
  double LongerIfLower(const LineSearchResult& found, const LineStart& start);

  GradientOptions options_;
  Sampling sampling_;
  std::unique_ptr<GradientDirection> direction_rule_;
  TermSampler sampler_;
  TermMask all_;
  SmoothObjective objective_;
  ProjectedLine line_;
  TermGradients at_x_;    ///< of the batch
  TermGradients memory_;  ///< incremental: of all terms, each at the x of its last refresh
  TermModels models_;     ///< incremental: of all terms, each of its last refresh, moved along with x
  bool filled_ = false;   ///< memory_ and models_ have all terms
  bool looked_ = false;   ///< value_, exact_, at_x_ and gradient_ are of all terms at x
  double value_ = 0.0;    ///< smoothed, of the batch
  ObjectiveValue exact_;  ///< of the batch
  Eigen::VectorXd gradient_, memory_sum_, sampled_, direction_, zero_;
  double last_alpha_ = 0.0;  ///< 0: none yet
  std::vector<double> scratch_;
};

}  // namespace legopt
