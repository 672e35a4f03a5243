#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/solvers/cma_es_options.h"
#include "legopt/solvers/covariance_adaptation.h"
#include "legopt/solvers/penalty_solver.h"

namespace legopt {

/// CMA-ES (covariance_adaptation.h) on the exact penalty objective F + mu V: the derivative-free baseline. It uses only
/// values of the objective and leaves out fixed variables.
///
/// Samples are tangent vectors at the mean x. A sample beyond the bounds is evaluated at its projection and ranked by
///
///     F + mu V + (2 r / n) sum_i (d_i / s_i)^2,
///
/// where d_i is its distance to the bounds, s_i the standard deviation of variable i, and r the quartile range of
/// F + mu V in the generation (after Hansen, Niederberger, Guzzella, Koumoutsakos, IEEE TEC 13(1), 2009, with r of a
/// single generation). The mean may leave the bounds, and x is its projection: around a mean at the bounds, half of the
/// samples would move inwards, in every variable. Covariance and step length are kept when mu changes, because mu
/// changes the weight of the constraints but not their directions.
class CmaEsSolver : public PenaltySolver {
 public:
  /// `options` must have passed Method::Validate.
  explicit CmaEsSolver(const CmaEsOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Evaluates all samples around x and stores the best in best_point_ and best_value_. Returns false if none is
  /// finite.
  bool EvaluateSamples(Program& program, const Eigen::VectorXd& x);
  /// Sorts the indices of the samples in order_, best first.
  void Rank();
  /// Returns the quartile range of the finite merits.
  double QuartileRange();
  /// Sets step_ = beyond_ + `free` at the free variables, clipped to the bounds, and cut_ to the clipped part. Returns
  /// the sum of squares of cut_ in standard deviations.
  double ClippedStep(Eigen::Ref<const Eigen::VectorXd> free);

  CmaEsOptions options_;
  CovarianceAdaptation distribution_;
  std::vector<Eigen::Index> free_;  ///< variables that are not fixed
  Eigen::VectorXd beyond_, cut_;    ///< free variables: the mean minus x, zero within the bounds; clipped part of step_
  Eigen::VectorXd lower_, upper_, step_, point_, best_point_;
  ObjectiveValue best_value_;               ///< best sample of the generation
  std::vector<double> merits_, distances_;  ///< one entry per sample
  std::vector<double> sorted_, residuals_;
  std::vector<int> order_;
};

}  // namespace legopt
