#include "legopt/dynamics/internal/chain_program.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace legopt {
namespace {

/// Constraint from x_k + to x_k+1 <= right, with its slack and multiplier.
struct Row {
  size_t k;
  double from, to, right;
  double slack = 1.0, multiplier = 1.0;
  double next_slack = 1.0, next_multiplier = 1.0;
};

/// min f(x) s.t. rows, over the inner points of a chain; a workspace of one solve. All numbers are in units of `scale`.
class ChainProgram {
 public:
  ChainProgram(const PathLimits& path, const std::vector<double>& start)
      : grid_(path.grid), x_(start), scale_(*std::max_element(start.begin(), start.end())) {
    for (double& x : x_) x /= scale_;
    for (size_t k = 0; k < path.intervals.size(); ++k) AddRows(k, path.intervals[k]);
    Start();
  }

  bool Solve() {
    constexpr int kMostIterations = 150;
    constexpr double kSmallGap = 1e-8, kPermittedGap = 1e-5, kSmallResidual = 1e-9;
    const auto ends = [&](double gap) { return gap_ < gap * time_ && primal_ < kSmallResidual && dual_ < gap * time_; };
    for (int k = 0; k < kMostIterations; ++k) {
      Measure();
      if (!std::isfinite(time_ + gap_ + primal_ + dual_)) return false;
      if (ends(kSmallGap)) return true;
      if (!Step()) break;
    }
    Measure();
    return ends(kPermittedGap);
  }

  void Store(std::vector<double>* x) const {
    for (size_t k = 0; k < x_.size(); ++k) (*x)[k] = scale_ * x_[k];
  }

 private:
  double Width(size_t k) const { return grid_[k + 1] - grid_[k]; }

  void AddRows(size_t k, const PhaseSet& set) {
    // a u + b x <= c with u = (x_k+1 - x_k) / 2 D; degenerate sets are widened by rounding
    constexpr double kWiden = 1e-10;
    const double rate = 1.0 / (2.0 * Width(k));
    for (const PhaseEdge& edge : set.edges) {
      Row row{.k = k, .from = edge.b - edge.a * rate, .to = edge.a * rate, .right = edge.c / scale_};
      const double norm = std::hypot(row.from, row.to);
      if (!(norm > 0.0)) continue;
      row.from /= norm;
      row.to /= norm;
      row.right = row.right / norm + kWiden;
      rows_.push_back(row);
    }
  }

  void Start() {
    constexpr double kShare = 0.9, kLeastSlack = 1e-3;
    for (double& x : x_) x *= kShare;
    const double least = kLeastSlack;
    for (size_t k = 1; k + 1 < x_.size(); ++k) x_[k] = std::max(x_[k], 1e-6);
    for (Row& row : rows_) {
      row.slack = std::max(least, row.right - Value(row));
      row.multiplier = 1e-2 / row.slack;
    }
    gradient_.resize(x_.size());
    diagonal_.resize(x_.size());
    above_.resize(x_.size());
    right_.resize(x_.size());
    step_.resize(x_.size());
  }

  double Value(const Row& row) const { return row.from * x_[row.k] + row.to * x_[row.k + 1]; }

  /// Gradient and second derivatives of the duration, and the residuals.
  void Measure() {
    std::fill(gradient_.begin(), gradient_.end(), 0.0);
    std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
    std::fill(above_.begin(), above_.end(), 0.0);
    time_ = 0.0;
    for (size_t k = 0; k + 1 < x_.size(); ++k) {
      const double D = Width(k), p = std::sqrt(x_[k]), q = std::sqrt(x_[k + 1]), S = p + q;
      time_ += 2.0 * D / S;
      if (p > 0.0) {
        gradient_[k] -= D / (p * S * S);
        diagonal_[k] += D / (2.0 * p * p * p * S * S) + D / (p * p * S * S * S);
      }
      if (q > 0.0) {
        gradient_[k + 1] -= D / (q * S * S);
        diagonal_[k + 1] += D / (2.0 * q * q * q * S * S) + D / (q * q * S * S * S);
      }
      if (p > 0.0 && q > 0.0) above_[k] += D / (p * q * S * S * S);
    }
    gap_ = primal_ = 0.0;
    right_ = gradient_;
    for (const Row& row : rows_) {
      gap_ += row.slack * row.multiplier;
      primal_ = std::max(primal_, std::abs(Value(row) + row.slack - row.right));
      right_[row.k] += row.from * row.multiplier;
      right_[row.k + 1] += row.to * row.multiplier;
    }
    dual_ = 0.0;
    for (size_t k = 1; k + 1 < x_.size(); ++k) dual_ = std::max(dual_, std::abs(right_[k]));
  }

  /// One Newton step; false if no step is possible.
  bool Step() {
    constexpr double kCentering = 0.15, kShareOfWay = 0.99;
    const double mu = kCentering * gap_ / static_cast<double>(rows_.size());
    for (double& r : right_) r = -r;
    for (const Row& row : rows_) {
      const double weight = row.multiplier / row.slack;
      const double residual = Value(row) + row.slack - row.right;
      const double change = (mu - row.slack * row.multiplier + row.multiplier * residual) / row.slack;
      diagonal_[row.k] += weight * row.from * row.from;
      diagonal_[row.k + 1] += weight * row.to * row.to;
      above_[row.k] += weight * row.from * row.to;
      right_[row.k] -= row.from * change;
      right_[row.k + 1] -= row.to * change;
    }
    if (!SolveTridiagonal()) return false;
    double length = 1.0, dual_length = 1.0;
    for (size_t k = 1; k + 1 < x_.size(); ++k) {
      if (step_[k] < 0.0) length = std::min(length, -kShareOfWay * x_[k] / step_[k]);
    }
    for (const Row& row : rows_) {
      const auto [slack, multiplier] = Changes(row, mu);
      if (slack < 0.0) length = std::min(length, -kShareOfWay * row.slack / slack);
      if (multiplier < 0.0) dual_length = std::min(dual_length, -kShareOfWay * row.multiplier / multiplier);
    }
    length = dual_length = std::min(length, dual_length);
    constexpr double kShortest = 1e-12;
    if (!(length > kShortest)) return false;
    for (Row& row : rows_) {
      const auto [slack, multiplier] = Changes(row, mu);
      row.next_slack = row.slack + length * slack;
      row.next_multiplier = row.multiplier + dual_length * multiplier;
    }
    for (Row& row : rows_) {
      row.slack = row.next_slack;
      row.multiplier = row.next_multiplier;
    }
    for (size_t k = 1; k + 1 < x_.size(); ++k) x_[k] += length * step_[k];
    return true;
  }

  /// Changes of slack and multiplier that belong to step_.
  std::pair<double, double> Changes(const Row& row, double mu) const {
    const double residual = Value(row) + row.slack - row.right;
    const double slack = -residual - row.from * step_[row.k] - row.to * step_[row.k + 1];
    return {slack, (mu - row.slack * row.multiplier - row.multiplier * slack) / row.slack};
  }

  /// Solves for step_ at the inner points.
  bool SolveTridiagonal() {
    const size_t last = x_.size() - 2;
    step_.front() = step_.back() = 0.0;
    for (size_t k = 1; k <= last; ++k) {
      if (k > 1) {
        const double factor = above_[k - 1] / diagonal_[k - 1];
        diagonal_[k] -= factor * above_[k - 1];
        right_[k] -= factor * right_[k - 1];
      }
      if (!(diagonal_[k] > 0.0) || !std::isfinite(diagonal_[k])) return false;
    }
    for (size_t k = last; k >= 1; --k) {
      step_[k] = (right_[k] - (k < last ? above_[k] * step_[k + 1] : 0.0)) / diagonal_[k];
    }
    return true;
  }

  std::span<const double> grid_;
  std::vector<double> x_;
  double scale_;
  std::vector<Row> rows_;
  std::vector<double> gradient_, diagonal_, above_, right_, step_;
  double time_ = 0.0, gap_ = 0.0, primal_ = 0.0, dual_ = 0.0;
};

}  // namespace

bool MinimizeDuration(const PathLimits& path, std::vector<double>* x) {
  const bool moves = *std::max_element(x->begin(), x->end()) > 0.0;
  if (path.grid.size() < 3 || !moves) return false;  // nothing to choose
  ChainProgram program(path, *x);
  if (!program.Solve()) return false;
  program.Store(x);
  return true;
}

}  // namespace legopt
