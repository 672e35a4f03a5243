#pragma once

#include <Eigen/Core>
#include <memory>

#include "legopt/problem/program.h"
#include "legopt/solvers/internal/penalty_solver.h"
#include "legopt/solvers/internal/smooth_objective.h"
#include "legopt/solvers/internal/term_sampler.h"
#include "legopt/solvers/penalty_options.h"
#include "legopt/solvers/solver.h"

namespace legopt {

/// Rule that turns g_k, the sampled or remembered gradient, into the direction d_k of the step -alpha d_k.
class GradientDirection {
 public:
  virtual ~GradientDirection() = default;
  /// Sets k = 0 and discards all gradients.
  virtual void Reset(const Program& program) = 0;
  /// Adds a gradient and computes the next `direction`, which already has the gradient's size.
  virtual void Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) = 0;
  /// Returns true if the direction depends on earlier gradients.
  virtual bool remembers() const { return false; }
};

/// SGD: d = g.
class SteepestDirection : public GradientDirection {
 public:
  void Reset(const Program&) override {}
  void Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) override { direction = gradient; }
};

/// Adam and Nadam (paper, (18) to (20)): with m_k = beta1 m_{k-1} + (1 - beta1) g_k, v_k = beta2 v_{k-1} + (1 - beta2)
/// g_k^2, k = 1, 2, ..,
///     d = mhat / (sqrt(v_k / (1 - beta2^k)) + epsilon),   element by element,
///     Adam   mhat = m_k / (1 - beta1^k)
///     Nadam  mhat = beta1 m_k / (1 - beta1^(k+1)) + (1 - beta1) g_k / (1 - beta1^k)
class MomentDirection : public GradientDirection {
 public:
  /// Nadam if `nesterov`, else Adam.
  MomentDirection(const MomentOptions& options, bool nesterov) : options_(options), nesterov_(nesterov) {}
  void Reset(const Program& program) override;
  void Next(const Eigen::VectorXd& gradient, Eigen::VectorXd& direction) override;
  bool remembers() const override { return true; }

 private:
  MomentOptions options_;
  bool nesterov_;
  double beta1_power_ = 1.0, beta2_power_ = 1.0;  ///< beta^k
  Eigen::VectorXd first_, second_;
};

/// Gradient descent on the smoothed penalty objective (paper, (13) to (22)) in the tangent space of the program:
///     x_{k+1} = P_C(x_k - alpha_k d_k).
/// A GradientDirection gives d_k, and Wolfe's strong conditions give alpha_k.
///
/// Each iteration evaluates only the terms of a mini-batch (docs/explanation/paper.md#terms-and-samples).
/// **Stochastic** (sample below 100 %): direction and line search use the batch only. **Incremental**: the direction
/// uses the sum of the last gradients of all terms; those of the batch are recomputed (all of them at the first
/// iteration of a mu). The line search uses the batch and the last linear models of the other terms, moved along with x
/// as in I-SQP (docs/explanation/paper.md#line-search). The exact objective is evaluated once per epoch. It determines
/// improvement, feasibility and the best point.
///
/// If the line search finds no Wolfe point, it takes the lowest point of sufficient decrease, or the short step if that
/// is longer and lower. No step increases the objective that the search evaluates. If d_k is no descent direction, x
/// stays and the next batch follows: moments keep turning towards the gradient.
class GradientSolver : public PenaltySolver {
 public:
  /// `direction` computes d_k from g_k; the solver owns it. `sampling` selects the terms that an iteration evaluates.
  GradientSolver(const GradientOptions& options, std::unique_ptr<GradientDirection> direction,
                 const Sampling& sampling);

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Returns whether directions and searches use remembered data of terms outside the batch.
  bool remembers_terms() const { return sampling_.incremental && !sampler_.everything(); }
  /// Computes smoothed value and gradients of the terms of `batch` at x. Fills the memory of all terms if it is empty.
  void LinearizeAt(Program& program, const Eigen::VectorXd& x, const TermMask& batch);
  /// Returns the gradient for the direction: that of the batch or, with a memory, that of all terms.
  const Eigen::VectorXd& SampledGradient(const Program& program, const TermMask& batch);
  /// Searches along line_. Returns whether x moved.
  bool Step(const Program& program, Eigen::VectorXd& x);
  /// Returns the short step's alpha if it is longer and lower than the result of the search, else the latter's alpha.
  double LongerIfLower(const LineSearchResult& found, const LineStart& start);

  GradientOptions options_;
  Sampling sampling_;
  std::unique_ptr<GradientDirection> direction_rule_;
  TermSampler sampler_;
  TermMask all_;
  SmoothObjective objective_;
  ProjectedLine line_;
  TermGradients at_x_;       ///< gradients of the batch
  TermGradients memory_;     ///< incremental: gradients of all terms, each at the x of its last refresh
  TermModels models_;        ///< incremental: models of all terms, each from its last refresh, moved along with x
  bool filled_ = false;      ///< memory_ and models_ contain all terms
  bool is_current_ = false;  ///< value_, exact_, at_x_ and gradient_ are up to date for all terms at x
  double value_ = 0.0;       ///< smoothed value of the batch
  ObjectiveValue exact_;     ///< exact value of the batch
  Eigen::VectorXd gradient_, memory_sum_, sampled_, direction_, zero_;
  double last_alpha_ = 0.0;  ///< 0: none yet
  std::vector<double> scratch_;
};

}  // namespace legopt
