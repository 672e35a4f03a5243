#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <vector>

#include "legopt/math/random_numbers.h"
#include "legopt/solvers/internal/penalty_solver.h"
#include "legopt/solvers/penalty_options.h"

namespace legopt {

/// The search distribution N(m, sigma^2 C) of CMA-ES (Hansen, "The CMA Evolution Strategy: A Tutorial", 2016,
/// arXiv:1604.00772) with the default constants of that text: weighted recombination of lambda samples, cumulative
/// step-size adaptation, rank-one and rank-mu updates of C, the latter with negative weights (active).
///
/// The mean m is not stored: samples are steps from it, so the class also works on manifolds. C is decomposed as
/// B D^2 B^T every 1 / (2 n (c_1 + c_mu)) generations, a fifth as often as in the tutorial, because in windows of
/// motions the decomposition would take longer than the terms.
///
///     distribution.Reset(n, DefaultSamples(n), 0.1);
///     loop: Draw(generator); Evaluate m + sample(k) for each k; Update(indices, best sample first); m += mean_step()
///
/// One thread. Allocates in Reset() only.
class CovarianceAdaptation {
 public:
  /// Returns the usual number of samples, 4 + floor(3 ln n), for n >= 1 variables.
  static int DefaultSamples(Eigen::Index n);

  /// Resets to C = I and sigma = `sigma` > 0, for n >= 1 variables and `num_samples` >= 4 samples.
  void Reset(Eigen::Index n, int num_samples, double sigma);

  /// Samples N(0, sigma^2 C) num_samples() times.
  void Draw(std::mt19937_64& generator);
  /// Adapts sigma and C to a ranking of the samples: the indices of all samples, best first.
  void Update(const std::vector<int>& order);

  /// Overrides sigma, e.g. after a generation without finite values.
  void SetSigma(double sigma) { sigma_ = sigma; }

  int num_samples() const { return static_cast<int>(weights_.size()); }  ///< lambda
  auto sample(int k) const { return samples_.col(k); }                   ///< sigma y_k, of the last Draw()
  const Eigen::VectorXd& mean_step() const { return mean_step_; }        ///< sigma y_w of the last Update(), c_m = 1
  double sigma() const { return sigma_; }                                ///< overall standard deviation
  /// Standard deviation of one variable, sigma sqrt(C_ii).
  double deviation(Eigen::Index i) const { return sigma_ * std::sqrt(covariance_(i, i)); }
  /// Largest standard deviation of all variables.
  double LargestDeviation() const { return sigma_ * std::sqrt(covariance_.diagonal().maxCoeff()); }

 private:
  void SetConstants(Eigen::Index dimension, int num_samples);
  void AdaptCovariance(const std::vector<int>& order, bool stalled);
  void Decompose();
  /// Computes basis_ from the eigenvectors of the tridiagonal matrix.
  void ApplyReflections();

  NormalRandom normal_;
  Eigen::VectorXd weights_;  ///< w_i by rank; the negative ones last
  double mu_eff_ = 0.0, c_sigma_ = 0.0, d_sigma_ = 0.0, c_c_ = 0.0, c_1_ = 0.0, c_mu_ = 0.0;
  double expected_norm_ = 0.0;  ///< E|N(0, I)|
  int decomposition_period_ = 1;

  double sigma_ = 1.0;
  long generation_ = 0;
  int since_decomposition_ = 0;
  Eigen::MatrixXd covariance_;  ///< C; only the lower triangle is up to date
  Eigen::MatrixXd basis_;       ///< B
  Eigen::VectorXd scales_;      ///< diagonal of D
  Eigen::Tridiagonalization<Eigen::MatrixXd> tridiagonal_;
  Eigen::VectorXd diagonal_, subdiagonal_;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen_;  ///< decomposition of the tridiagonal matrix
  Eigen::MatrixXd normals_, samples_;                     ///< z_k and sigma B D z_k
  Eigen::VectorXd sigma_path_, path_;                     ///< p_sigma, p_c
  Eigen::VectorXd mean_normal_, mean_step_;  ///< sum of w_i z_i, sum of w_i sigma y_i over positive weights
  Eigen::VectorXd scaled_;
};

/// CMA-ES (cma_es_solver.h) on the exact penalty objective F + mu V: the derivative-free baseline. It uses only
/// values of the objective and leaves out fixed variables.
///
/// Samples are tangent vectors at the mean x. A sample beyond the bounds is evaluated at its projection and ranked by
///
///     F + mu V + (2 r / n) sum_i (d_i / s_i)^2,
///
/// where d_i is its distance to the bounds, s_i the standard deviation of variable i, and r the quartile range of
/// F + mu V in the generation (after Hansen, Niederberger, Guzzella, Koumoutsakos, IEEE TEC 13(1), 2009, with r of a
/// single generation). The mean may leave the bounds, and x is its projection: around a mean at the bounds, half of the
/// samples would move inwards, in every variable. Each restart takes population_growth times as many samples.
/// Covariance and step length are kept when mu changes, because mu changes the weight of the constraints but not their
/// directions.
class CmaEsSolver : public PenaltySolver {
 public:
  /// `options` must have passed Method::Validate.
  explicit CmaEsSolver(const CmaEsOptions& options) : PenaltySolver(options.penalty), options_(options) {}

 private:
  void Prepare(Program& program) override;
  void Restart(Program& program) override;
  EpochEnd Epoch(Program& program, Eigen::VectorXd& x) override;

  /// Returns the number of samples of this attempt.
  int NumSamples() const;
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
