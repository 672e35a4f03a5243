#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "legopt/statistics/interval.h"

namespace legopt::statistics {

/// A number computed of problems: `problems` are indices into whatever it looks at, of one method or of several, not
/// descending; an index may occur several times. +-infinity is a value, NaN an error.
using ProblemStatistic = std::function<double(std::span<const int> problems)>;

/// How the ends are read off the resampled values.
enum class BootstrapKind : std::uint8_t {
  kBca,         ///< bias-corrected and accelerated: for ratios of means, PAR, ERT
  kPercentile,  ///< plain quantiles: for bands of profiles, where nothing else is defined at 0 and 1
};

/// How a bootstrap is made.
struct BootstrapOptions {
  int resamples = 10'000;                    ///< 1..1,000,000; below 1,000 the ends are rough
  double level = 0.95;                       ///< of confidence, in (0, 1)
  std::uint64_t seed = 1;                    ///< of all draws
  BootstrapKind kind = BootstrapKind::kBca;  ///< how the ends are read off
};

/// A value with its interval, and what made it.
struct BootstrapEstimate {
  double value = 0.0;  ///< the statistic of all problems as they are; NaN of no problems
  Interval interval;   ///< its confidence interval; the whole line of fewer than two problems
  double standard_error =
      0;              ///< standard deviation of the resampled values, divisor resamples - 1; NaN where undefined
  double bias = 0.0;  ///< z0 of BCa; 0 of percentiles
  double acceleration = 0.0;  ///< a of BCa; 0 of percentiles, and where the jackknife has no spread or is not finite
  Interval levels;            ///< the quantiles of the resampled values that the ends are, in [0, 1]
};

/// Interval of a statistic by drawing as many problems with replacement, again and again (Efron 1987, JASA 82:171;
/// Efron, Tibshirani 1993, chapter 14). Paired by construction: the statistic sees the drawn problems of both methods.
///
/// BCa: z0 = Phi^-1(share of resampled values below the value, ties half), kept within half a resample of 0 and 1;
/// a = sum u^3 / (6 (sum u^2)^1.5) with u = mean - jackknife value; levels see BcaLevels. Ends are quantiles of type 7.
/// Constant values: an interval of one point.
///
/// Draws come from a 64-bit Mersenne twister seeded by `seed`, index = floor(uniform of 53 bits times n), resample
/// after resample: the same on every machine. Rounding of the C library's exp and log apart, so is the result. The
/// statistic is called resamples + problems + 1 times, from the calling thread. Throws InputError for options out of
/// range, a negative number of problems, and a statistic that says NaN; what the statistic throws passes.
BootstrapEstimate Bootstrap(int problems, const ProblemStatistic& statistic, const BootstrapOptions& options = {});

/// Phi(z0 + (z0 + z) / (1 - a (z0 + z))) for the quantiles z of both ends of the level. z0 = a = 0 gives the percentile
/// levels. Where the denominator is not positive, the level is that of the end it leaves by, 0 or 1. Throws InputError
/// for NaN, infinities and a `level` outside of (0, 1).
Interval BcaLevels(double bias, double acceleration, double level);

}  // namespace legopt::statistics
