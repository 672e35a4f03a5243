#include "legopt/solvers/internal/cma_es_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "legopt/types/invariant.h"

namespace legopt {

int CovarianceAdaptation::DefaultSamples(Eigen::Index n) {
  return 4 + static_cast<int>(std::floor(3.0 * std::log(static_cast<double>(n))));
}

void CovarianceAdaptation::Reset(Eigen::Index n, int num_samples, double sigma) {
  CheckInvariant(n >= 1 && num_samples >= 4 && sigma > 0.0, "a distribution has variables, samples and a spread");
  SetConstants(n, num_samples);
  normal_.Reset();
  sigma_ = sigma;
  generation_ = 0;
  since_decomposition_ = 0;
  covariance_.setIdentity(n, n);
  basis_.setIdentity(n, n);
  scales_.setOnes(n);
  if (diagonal_.size() != n) {
    tridiagonal_ = Eigen::Tridiagonalization<Eigen::MatrixXd>(n);
    eigen_ = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(n);
  }
  diagonal_.setZero(n);
  subdiagonal_.setZero(n - 1);
  normals_.setZero(n, num_samples);
  samples_.setZero(n, num_samples);
  for (auto* v : {&sigma_path_, &path_, &mean_normal_, &mean_step_, &scaled_}) v->setZero(n);
}

void CovarianceAdaptation::SetConstants(Eigen::Index dimension, int num_samples) {
  const double n = static_cast<double>(dimension);
  const int lambda = num_samples;
  const int mu = lambda / 2;
  weights_.resize(lambda);
  for (int i = 0; i < lambda; ++i) weights_[i] = std::log((lambda + 1) / 2.0) - std::log(i + 1.0);
  auto positive = weights_.head(mu);
  auto negative = weights_.tail(lambda - mu);
  const auto effective = [](const auto& w) { return w.sum() * w.sum() / w.squaredNorm(); };
  mu_eff_ = effective(positive);
  const double negative_mu_eff = effective(negative);

  c_sigma_ = (mu_eff_ + 2.0) / (n + mu_eff_ + 5.0);
  d_sigma_ = 1.0 + 2.0 * std::max(0.0, std::sqrt((mu_eff_ - 1.0) / (n + 1.0)) - 1.0) + c_sigma_;
  c_c_ = (4.0 + mu_eff_ / n) / (n + 4.0 + 2.0 * mu_eff_ / n);
  c_1_ = 2.0 / ((n + 1.3) * (n + 1.3) + mu_eff_);
  c_mu_ = std::min(1.0 - c_1_, 2.0 * (0.25 + mu_eff_ + 1.0 / mu_eff_ - 2.0) / ((n + 2.0) * (n + 2.0) + mu_eff_));
  expected_norm_ = std::sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n));

  // Limits of the sum of the negative weights: it keeps the scale of C, fits their variance, and keeps C definite.
  const double negative_sum =
      std::min({1.0 + c_1_ / c_mu_, 1.0 + 2.0 * negative_mu_eff / (mu_eff_ + 2.0), (1.0 - c_1_ - c_mu_) / (n * c_mu_)});
  positive /= positive.sum();
  const double norm = negative.cwiseAbs().sum();
  negative *= norm > 0.0 ? std::max(negative_sum, 0.0) / norm : 0.0;
  decomposition_period_ = std::max(1, static_cast<int>(std::floor(0.5 / (n * (c_1_ + c_mu_)))));
}

void CovarianceAdaptation::Draw(std::mt19937_64& generator) {
  for (int k = 0; k < num_samples(); ++k) {
    auto z = normals_.col(k);
    for (double& entry : z) entry = normal_.Next(generator);
    scaled_ = sigma_ * scales_.cwiseProduct(z);
    samples_.col(k).noalias() = basis_ * scaled_;
  }
}

void CovarianceAdaptation::Update(const std::vector<int>& order) {
  ++generation_;
  mean_normal_.setZero();
  mean_step_.setZero();
  for (int i = 0; i < num_samples() / 2; ++i) {
    mean_normal_ += weights_[i] * normals_.col(order[static_cast<size_t>(i)]);
    mean_step_ += weights_[i] * samples_.col(order[static_cast<size_t>(i)]);
  }
  // C^-1/2 y_w = B z_w.
  scaled_.noalias() = basis_ * mean_normal_;
  sigma_path_ = (1.0 - c_sigma_) * sigma_path_ + std::sqrt(c_sigma_ * (2.0 - c_sigma_) * mu_eff_) * scaled_;
  const double length = sigma_path_.norm();
  const double started = std::sqrt(1.0 - std::pow(1.0 - c_sigma_, 2.0 * static_cast<double>(generation_)));
  const double n = static_cast<double>(path_.size());
  const bool stalled = length / started >= (1.4 + 2.0 / (n + 1.0)) * expected_norm_;
  path_ *= 1.0 - c_c_;
  if (!stalled) path_ += (std::sqrt(c_c_ * (2.0 - c_c_) * mu_eff_) / sigma_) * mean_step_;
  AdaptCovariance(order, stalled);
  sigma_ *= std::exp(std::min(1.0, c_sigma_ / d_sigma_ * (length / expected_norm_ - 1.0)));
  if (++since_decomposition_ >= decomposition_period_) Decompose();
}

void CovarianceAdaptation::AdaptCovariance(const std::vector<int>& order, bool stalled) {
  const double made_up = stalled ? c_1_ * c_c_ * (2.0 - c_c_) : 0.0;
  covariance_.triangularView<Eigen::Lower>() *= 1.0 + made_up - c_1_ - c_mu_ * weights_.sum();
  auto lower = covariance_.selfadjointView<Eigen::Lower>();
  lower.rankUpdate(path_, c_1_);
  const double n = static_cast<double>(path_.size());
  for (int i = 0; i < num_samples(); ++i) {
    const int k = order[static_cast<size_t>(i)];
    double weight = weights_[i];
    // Scaled to the expected length, no sample removes more variance than C has.
    if (weight < 0.0) weight *= n / std::max(normals_.col(k).squaredNorm(), 1e-12);
    scaled_ = samples_.col(k) / sigma_;
    lower.rankUpdate(scaled_, c_mu_ * weight);
  }
}

void CovarianceAdaptation::Decompose() {
  constexpr double kLargestCondition = 1e14;
  since_decomposition_ = 0;
  // Equivalent to eigen_.compute(), without its allocations.
  tridiagonal_.compute(covariance_);
  diagonal_ = tridiagonal_.diagonal();
  subdiagonal_ = tridiagonal_.subDiagonal();
  eigen_.computeFromTridiagonal(diagonal_, subdiagonal_);
  if (eigen_.info() != Eigen::Success) return;  // keep the previous basis
  const double most = eigen_.eigenvalues().maxCoeff();
  const double least = most / kLargestCondition;
  if (eigen_.eigenvalues().minCoeff() < least) {
    covariance_.diagonal().array() += least - std::min(eigen_.eigenvalues().minCoeff(), 0.0);
  }
  scales_ = eigen_.eigenvalues().cwiseMax(least).cwiseSqrt();
  ApplyReflections();
}

void CovarianceAdaptation::ApplyReflections() {
  basis_ = eigen_.eigenvectors();
  const Eigen::Index n = basis_.rows();
  for (Eigen::Index k = n - 2; k >= 0; --k) {
    const auto essential = tridiagonal_.packedMatrix().col(k).tail(n - k - 2);
    const double square = essential.squaredNorm();
    if (square == 0.0) continue;  // nothing to reflect
    basis_.bottomRows(n - k - 1).applyHouseholderOnTheLeft(essential, 2.0 / (1.0 + square), scaled_.data());
  }
}

void CmaEsSolver::Prepare(Program& program) {
  const Eigen::Index tangent = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  for (auto* v : {&lower_, &upper_, &step_}) v->setZero(tangent);
  for (auto* v : {&point_, &best_point_}) {
    v->setZero(static_cast<Eigen::Index>(program.num_waypoints()) * program.point_size());
  }
  program.StepBounds(point_, lower_, upper_);  // fixed variables are the same at every point
  free_.clear();
  for (Eigen::Index i = 0; i < tangent; ++i) {
    if (lower_[i] < upper_[i]) free_.push_back(i);
  }
  if (free_.empty()) return;
  for (auto* v : {&beyond_, &cut_}) v->setZero(static_cast<Eigen::Index>(free_.size()));
  distribution_.Reset(static_cast<Eigen::Index>(free_.size()), NumSamples(), options_.step);
  const auto samples = static_cast<size_t>(distribution_.num_samples());
  merits_.assign(samples, 0.0);
  distances_.assign(samples, 0.0);
  order_.assign(samples, 0);
  sorted_.reserve(samples);
}

int CmaEsSolver::NumSamples() const {
  constexpr double kMostSamples = 5e3;  // bounds the time between two stop checks
  const double usual = CovarianceAdaptation::DefaultSamples(static_cast<Eigen::Index>(free_.size()));
  return static_cast<int>(std::min(usual * std::pow(options_.population_growth, context().restart), kMostSamples));
}

void CmaEsSolver::Restart(Program&) { beyond_.setZero(); }

PenaltySolver::EpochEnd CmaEsSolver::Epoch(Program& program, Eigen::VectorXd& x) {
  if (!NextIteration()) return EpochEnd::kInterrupted;
  if (free_.empty()) return EpochEnd::kStuck;
  program.StepBounds(x, lower_, upper_);
  distribution_.Draw(context().rng());
  if (EvaluateSamples(program, x)) {
    Visit(best_point_, best_value_);
    Rank();
    distribution_.Update(order_);
    ClippedStep(distribution_.mean_step());
    beyond_ = cut_;
    program.Retract(x, step_, point_);
    x.swap(point_);
    Visit(x, EvaluateObjective(program, x, residuals_));
  } else {
    constexpr double kCloser = 0.5;
    distribution_.SetSigma(kCloser * distribution_.sigma());
  }
  const double largest = distribution_.LargestDeviation();
  const double floor = std::min(options_.step_floor, options_.step);
  if (largest < floor) distribution_.SetSigma(distribution_.sigma() * floor / largest);
  return EpochEnd::kDone;
}

bool CmaEsSolver::EvaluateSamples(Program& program, const Eigen::VectorXd& x) {
  double lowest = std::numeric_limits<double>::infinity();
  for (int k = 0; k < distribution_.num_samples(); ++k) {
    distances_[static_cast<size_t>(k)] = ClippedStep(distribution_.sample(k));
    program.Retract(x, step_, point_);
    const ObjectiveValue value = EvaluateObjective(program, point_, residuals_);
    double& merit = merits_[static_cast<size_t>(k)];
    merit = value.IsFinite() ? value.Merit(penalty()) : std::numeric_limits<double>::infinity();
    if (!(merit < lowest)) continue;
    lowest = merit;
    best_point_.swap(point_);
    best_value_ = value;
  }
  return std::isfinite(lowest);
}

void CmaEsSolver::Rank() {
  const double weight = 2.0 * QuartileRange() / static_cast<double>(free_.size());
  for (size_t k = 0; k < merits_.size(); ++k) merits_[k] += weight * distances_[k];
  std::iota(order_.begin(), order_.end(), 0);
  std::sort(order_.begin(), order_.end(), [this](int a, int b) {
    const double merit_a = merits_[static_cast<size_t>(a)], merit_b = merits_[static_cast<size_t>(b)];
    return merit_a != merit_b ? merit_a < merit_b : a < b;
  });
}

double CmaEsSolver::QuartileRange() {
  sorted_.clear();
  for (const double merit : merits_) {
    if (std::isfinite(merit)) sorted_.push_back(merit);
  }
  std::sort(sorted_.begin(), sorted_.end());
  const size_t last = sorted_.size() - 1;
  return sorted_[3 * last / 4] - sorted_[last / 4];
}

double CmaEsSolver::ClippedStep(Eigen::Ref<const Eigen::VectorXd> free) {
  double squares = 0.0;
  for (size_t j = 0; j < free_.size(); ++j) {
    const Eigen::Index i = free_[j];
    const auto place = static_cast<Eigen::Index>(j);
    const double wanted = beyond_[place] + free[place];
    step_[i] = std::clamp(wanted, lower_[i], upper_[i]);
    cut_[place] = wanted - step_[i];
    if (cut_[place] == 0.0) continue;
    const double deviations = cut_[place] / distribution_.deviation(place);
    squares += deviations * deviations;
  }
  return squares;
}

}  // namespace legopt
