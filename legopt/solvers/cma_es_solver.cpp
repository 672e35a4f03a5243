#include "legopt/solvers/cma_es_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace legopt {

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
  distribution_.Reset(static_cast<Eigen::Index>(free_.size()), options_.step);
  const auto samples = static_cast<size_t>(distribution_.num_samples());
  merits_.assign(samples, 0.0);
  distances_.assign(samples, 0.0);
  order_.assign(samples, 0);
  sorted_.reserve(samples);
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
