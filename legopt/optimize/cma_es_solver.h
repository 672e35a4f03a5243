#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/optimize/cma_es_options.h"
#include "legopt/optimize/covariance_adaptation.h"
#include "legopt/optimize/penalty_solver.h"

namespace legopt {

/// CMA-ES (covariance_adaptation.h) on the exact penalty objective F + mu V: the derivative-free baseline. It sees
/// values only, and no structure of the program but which variables are fixed; these are left out.
///
/// Samples are tangent vectors at the mean x. One beyond the bounds is evaluated at its projection and ranked by
///
///     F + mu V + (2 r / n) sum_i (d_i / s_i)^2,
///
/// d_i its distance to the bounds, s_i the standard deviation of variable i, r the quartile range of the generation's
/// F + mu V (after Hansen, Niederberger, Guzzella, Koumoutsakos, IEEE TEC 13(1), 2009, with r of one generation). The
/// mean may leave the bounds, too: one that stood at them would lose half of its samples there to the inside, in every
/// variable. x is its projection. Covariance and step length go on from one mu to the next: what changes is the weight
/// of the constraints, not their directions.
class CmaEsSolver : public PenaltySolver {
 public:
  /// Options as checked by Method::Validate; not looked at again.
  explicit CmaEsSolver(const CmaEsOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Evaluates all samples around x; false when none is finite. Leaves the best in best_point_, best_value_.
  bool EvaluateSamples(Program& program, const Eigen::VectorXd& x);
  /// order_ = numbers of the samples, best first.
  void Rank();
  /// Quartile range of the finite merits.
  double QuartileRange();
  /// step_ = beyond_ + `free` at the free variables, kept within the bounds; cut_ = what that takes away. The sum of
  /// its squares, in standard deviations.
  double ClippedStep(Eigen::Ref<const Eigen::VectorXd> free);

  CmaEsOptions options_;
  CovarianceAdaptation distribution_;
  std::vector<Eigen::Index> free_;  ///< variables that are not fixed
  Eigen::VectorXd beyond_, cut_;    ///< of the free variables: the mean less x, zero within the bounds
  Eigen::VectorXd lower_, upper_, step_, point_, best_point_;
  ObjectiveValue best_value_;               ///< of the generation
  std::vector<double> merits_, distances_;  ///< of the samples
  std::vector<double> sorted_, residuals_;
  std::vector<int> order_;
};

}  // namespace legopt
