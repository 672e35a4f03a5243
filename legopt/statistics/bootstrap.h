#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "legopt/statistics/problem_scores.h"

namespace legopt::statistics {

/// A number computed from problems. `problems` are ascending indices, possibly repeated, into the caller's data of one
/// or several methods. +-infinity is a valid value, NaN an error.
using ProblemStatistic = std::function<double(std::span<const int> problems)>;

/// Method of computing the interval from the resampled values.
enum class BootstrapKind : std::uint8_t {
  kBca,         ///< bias-corrected and accelerated: for ratios of means, PAR, ERT
  kPercentile,  ///< plain quantiles: for bands of profiles, where BCa is undefined at 0 and 1
};

/// Options of a bootstrap.
struct BootstrapOptions {
  int resamples = 10'000;  ///< 1..1,000,000; below 1,000 the interval is inaccurate
  double level = 0.95;     ///< confidence level, in (0, 1)
  std::uint64_t seed = 1;
  BootstrapKind kind = BootstrapKind::kBca;
};

/// A value with its bootstrap interval and intermediate results.
struct BootstrapEstimate {
  double value = 0.0;         ///< the statistic of all problems; NaN if there are none
  Interval interval;          ///< confidence interval; infinite with fewer than two problems
  double standard_error = 0;  ///< standard deviation of resampled values, divisor resamples - 1; NaN if undefined
  double bias = 0.0;          ///< z0 of BCa; 0 for percentiles
  double acceleration = 0.0;  ///< a of BCa; 0 for percentiles, and where the jackknife has no spread or is not finite
  Interval levels;            ///< quantile levels of the interval's ends, in [0, 1]
};

/// Computes the bootstrap interval of a statistic by resampling the problems with replacement (Efron 1987, JASA 82:171;
/// Efron, Tibshirani 1993, chapter 14). Comparisons are paired: the statistic gets the same resampled problems for both
/// methods.
///
/// BCa: z0 = Phi^-1(share of resampled values below the value, ties half), kept within half a resample of 0 and 1;
/// a = sum u^3 / (6 (sum u^2)^1.5) with u = mean - jackknife value; levels see BcaLevels. Ends are quantiles of type 7.
/// Constant values give an interval of one point.
///
/// Random indices come from a 64-bit Mersenne twister seeded by `seed`, index = floor(uniform of 53 bits times n), and
/// are the same on every machine. The result is the same up to the rounding of the C library's exp and log. The
/// statistic is called resamples + problems + 1 times, from the calling thread. Throws InputError for options out of
/// range, a negative number of problems, and a statistic that returns NaN; exceptions of the statistic propagate.
BootstrapEstimate Bootstrap(int problems, const ProblemStatistic& statistic, const BootstrapOptions& options = {});

/// Computes Phi(z0 + (z0 + z) / (1 - a (z0 + z))) for the quantiles z of both ends of the level. z0 = a = 0 gives the
/// percentile levels. If the denominator is not positive, the level is its limit, 0 or 1. Throws InputError for NaN,
/// infinities and a `level` outside (0, 1).
Interval BcaLevels(double bias, double acceleration, double level);

}  // namespace legopt::statistics
