#include "legopt/solvers/internal/line_search.h"

#include <algorithm>
#include <cmath>

namespace legopt {
namespace {

constexpr double kGrowth = 2.0;          // factor of the trial step while bracketing
constexpr double kInset = 0.1;           // interpolated steps keep this share of the interval from both ends
constexpr double kSmallInterval = 1e-9;  // relative to the larger end: intervals below this are not divided further

struct Point {
  double alpha = 0.0, value = 0.0, slope = 0.0;
};

class WolfeSearch {
 public:
  WolfeSearch(LineFunction& phi, const LineStart& start, const LineSearchOptions& options)
      : phi_(phi), start_(start), options_(options), low_{0.0, start.value, start.slope} {}

  LineSearchResult Run() {
    double alpha = std::min(start_.first_alpha, start_.max_alpha);
    while (trials_ < options_.max_trials) {
      Point trial = Try(alpha);
      if (TooHigh(trial)) {
        high_ = trial;
        return Zoom();
      }
      trial.slope = phi_.Slope();
      if (FlatEnough(trial)) return Found(trial);
      if (trial.slope >= 0.0) {
        high_ = low_;
        low_ = trial;
        return Zoom();
      }
      low_ = trial;
      if (alpha >= start_.max_alpha) break;
      alpha = std::min(kGrowth * alpha, start_.max_alpha);
    }
    return Lowest();
  }

 private:
  /// Searches between low_, the lowest point with sufficient decrease, whose slope points to high_, and high_.
  LineSearchResult Zoom() {
    while (trials_ < options_.max_trials &&
           std::abs(high_.alpha - low_.alpha) > kSmallInterval * std::max(high_.alpha, low_.alpha)) {
      Point trial = Try(Interpolate());
      if (TooHigh(trial)) {
        high_ = trial;
        continue;
      }
      trial.slope = phi_.Slope();
      if (FlatEnough(trial)) return Found(trial);
      if (trial.slope * (high_.alpha - low_.alpha) >= 0.0) high_ = low_;
      low_ = trial;
    }
    return Lowest();
  }

  Point Try(double alpha) {
    ++trials_;
    return {alpha, phi_.Value(alpha), 0.0};
  }

  bool TooHigh(const Point& p) const {
    return !std::isfinite(p.value) || p.value > start_.value + options_.sufficient_decrease * p.alpha * start_.slope ||
           (low_.alpha > 0.0 && p.value >= low_.value);
  }

  bool FlatEnough(const Point& p) const { return std::abs(p.slope) <= options_.curvature * std::abs(start_.slope); }

  /// Returns the minimiser of the parabola through both values and the slope at low_.
  double Interpolate() const {
    const double width = high_.alpha - low_.alpha;
    const double curvature = high_.value - low_.value - low_.slope * width;
    double share = -low_.slope * width / (2.0 * curvature);
    if (!std::isfinite(share)) share = kInset;  // outside the domain: return to it quickly
    return low_.alpha + std::clamp(share, kInset, 1.0 - kInset) * width;
  }

  LineSearchResult Found(const Point& p) const { return {p.alpha, p.value, true}; }
  LineSearchResult Lowest() const { return {low_.alpha, low_.value, false}; }

  LineFunction& phi_;
  const LineStart& start_;
  const LineSearchOptions& options_;
  Point low_, high_;
  int trials_ = 0;
};

}  // namespace

LineSearchResult SearchWolfe(LineFunction& phi, const LineStart& start, const LineSearchOptions& options) {
  return WolfeSearch(phi, start, options).Run();
}

}  // namespace legopt
