#include "legopt/statistics/bootstrap.h"

#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "legopt/math/random_numbers.h"
#include "legopt/statistics/internal/checks.h"
#include "legopt/statistics/problem_scores.h"

namespace legopt::statistics {
namespace {

constexpr char kName[] = "Bootstrap";

double ValueOf(const ProblemStatistic& statistic, std::span<const int> problems) {
  const double value = statistic(problems);
  if (std::isnan(value)) Refuse(kName, "statistic", "must not be NaN for any resample", value);
  return value;
}

constexpr int kAlwaysWritten = 2;

// Writes each index as often as it was drawn, ascending: another order of the same problems would change the rounding,
// and so the comparison with the value. Most indices are drawn at most kAlwaysWritten times. That many are written
// without a branch, which would be mispredicted, so `next` needs room for them at its end.
void WriteDrawn(std::span<const int> times_drawn, int* next) {
  for (int index = 0; index < static_cast<int>(times_drawn.size()); ++index) {
    const int times = times_drawn[static_cast<std::size_t>(index)];
    for (int i = 0; i < kAlwaysWritten; ++i) next[i] = index;
    for (int i = kAlwaysWritten; i < times; ++i) next[i] = index;
    next += times;
  }
}

std::vector<double> Resampled(int problems, const ProblemStatistic& statistic, const BootstrapOptions& options) {
  std::mt19937_64 generator(options.seed);
  const auto count = static_cast<std::size_t>(problems);
  std::vector<int> times_drawn(count), drawn(count + kAlwaysWritten);
  std::vector<double> values(static_cast<std::size_t>(options.resamples));
  for (double& value : values) {
    std::fill(times_drawn.begin(), times_drawn.end(), 0);
    for (int i = 0; i < problems; ++i) {
      ++times_drawn[static_cast<std::size_t>(UniformRandom(generator) * problems)];
    }
    WriteDrawn(times_drawn, drawn.data());
    value = ValueOf(statistic, {drawn.data(), count});
  }
  return values;
}

double BiasOf(double value, const std::vector<double>& resampled) {
  double below = 0.0;
  for (const double other : resampled) below += other < value ? 1.0 : other == value ? 0.5 : 0.0;
  const double count = static_cast<double>(resampled.size());
  return quantile(boost::math::normal(), std::clamp(below, 0.5, count - 0.5) / count);
}

double AccelerationOf(int problems, const ProblemStatistic& statistic) {
  std::vector<double> left_out(static_cast<std::size_t>(problems));
  std::vector<int> others(left_out.size() - 1);
  std::iota(others.begin(), others.end(), 1);
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    left_out[i] = ValueOf(statistic, others);
    if (i < others.size()) others[i] = static_cast<int>(i);  // the next problem is left out
  }
  const double mean = std::accumulate(left_out.begin(), left_out.end(), 0.0) / problems;
  double squares = 0.0;
  double cubes = 0.0;
  for (const double value : left_out) {
    const double u = mean - value;
    squares += u * u;
    cubes += u * u * u;
  }
  const double acceleration = cubes / (6.0 * squares * std::sqrt(squares));
  return std::isfinite(acceleration) ? acceleration : 0.0;
}

double DeviationOf(const std::vector<double>& values) {
  const double count = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / count;
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / (count - 1.0));  // NaN for a single resample, and if a value is infinite
}

// Quantiles of values that may include -infinity.
Interval IntervalEnds(std::vector<double> values, const Interval& levels) {
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (*least == *most) return {.lower = *least, .upper = *least};
  if (*least > -kInfinity) {
    const std::array<double, 2> shares{levels.lower, levels.upper};
    const std::vector<double> ends = Quantiles(values, shares);
    return {.lower = ends[0], .upper = ends[1]};
  }
  // Negated, so that quantiles between a number and an infinity are infinite at both ends. Both infinities: no
  // information.
  if (*most == kInfinity) return {.lower = -kInfinity, .upper = kInfinity};
  for (double& value : values) value = -value;
  const std::array<double, 2> shares{1.0 - levels.lower, 1.0 - levels.upper};
  const std::vector<double> ends = Quantiles(values, shares);
  return {.lower = -ends[0], .upper = -ends[1]};
}

void RequireOptions(const BootstrapOptions& options) {
  constexpr int kMaxResamples = 1'000'000;
  RequireCount(kName, "resamples", options.resamples, 1);
  if (options.resamples > kMaxResamples) {
    Refuse(kName, "resamples", "must not be above 1000000", options.resamples);
  }
  RequireLevel(kName, options.level);
}

}  // namespace

BootstrapEstimate Bootstrap(int problems, const ProblemStatistic& statistic, const BootstrapOptions& options) {
  RequireCount(kName, "problems", problems);
  RequireOptions(options);
  BootstrapEstimate estimate{.interval = {.lower = -kInfinity, .upper = kInfinity},
                             .levels = BcaLevels(0.0, 0.0, options.level)};
  if (problems < 2) estimate.standard_error = std::numeric_limits<double>::quiet_NaN();
  if (problems == 0) {
    estimate.value = std::numeric_limits<double>::quiet_NaN();
    return estimate;
  }
  std::vector<int> all(static_cast<std::size_t>(problems));
  std::iota(all.begin(), all.end(), 0);
  estimate.value = ValueOf(statistic, all);
  if (problems == 1) return estimate;
  const std::vector<double> resampled = Resampled(problems, statistic, options);
  if (options.kind == BootstrapKind::kBca) {
    estimate.bias = BiasOf(estimate.value, resampled);
    estimate.acceleration = AccelerationOf(problems, statistic);
    estimate.levels = BcaLevels(estimate.bias, estimate.acceleration, options.level);
  }
  estimate.standard_error = DeviationOf(resampled);
  estimate.interval = IntervalEnds(resampled, estimate.levels);
  return estimate;
}

Interval BcaLevels(double bias, double acceleration, double level) {
  RequireNumbers("BcaLevels", "bias", {&bias, 1});
  RequireNumbers("BcaLevels", "acceleration", {&acceleration, 1});
  RequireLevel("BcaLevels", level);
  const boost::math::normal standard;
  const double tail = 0.5 * (1.0 - level);
  const auto corrected = [&](double z) {
    const double shifted = bias + z;
    const double denominator = 1.0 - acceleration * shifted;
    if (denominator <= 0.0) return shifted > 0.0 ? 1.0 : 0.0;
    return cdf(standard, bias + shifted / denominator);
  };
  const double z = quantile(complement(standard, tail));
  return {.lower = corrected(-z), .upper = corrected(z)};
}

}  // namespace legopt::statistics
