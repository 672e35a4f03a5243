#pragma once

#include <span>
#include <vector>

/// Mean times that include the cost of failures. Times are in ms, one per problem, averaged over repetitions
/// (ProblemScore); where allowed, +infinity is an unsolved problem. Without problems every mean is NaN, which tables
/// show as a dash.
namespace legopt::statistics {

/// Computes PAR-k (Hutter et al. 2009, JAIR 36:267): the mean time, where an unsolved problem counts `factor` time
/// limits. A solved problem counts its own time, even above the limit. Throws InputError for negative times, NaN, a
/// limit that is not positive and finite, and a factor below 1.
double PenalisedAverage(std::span<const double> times_ms, double limit_ms, double factor);

/// Expected time until a problem is solved if failed runs are restarted.
struct ExpectedTime {
  double spent_ms = 0.0;   ///< time of all runs, solved or not
  double successes = 0.0;  ///< number of solved problems, or the sum of their shares
  double time_ms = 0.0;    ///< spent / successes; +infinity without successes, NaN without problems
};

/// Computes the ERT (Auger, Hansen 2005, CEC; COCO, arXiv:1605.03560): the time of all runs divided by the number of
/// successes. Per problem, `spent_ms` is the time of its run, failed or not (ProblemScore::Spent), and `shares` its
/// success, in [0, 1]. Throws InputError for times that are negative or not finite, shares outside [0, 1] and unequal
/// lengths.
ExpectedTime ExpectedRunningTime(std::span<const double> spent_ms, std::span<const double> shares);

/// Computes the shifted geometric mean (as in Mittelmann's benchmarks): exp(mean of ln max(1, t + s)) - s, all in ms,
/// so that the floor is 1 ms. A shift much larger than the times hides all differences: 1 to 10 ms suit solves of
/// milliseconds, Mittelmann's 10 s suit hours. One infinite time makes the mean infinite, so failures must be charged
/// before. Throws InputError for negative times, NaN, and a shift that is negative or not finite.
double ShiftedGeometricMean(std::span<const double> times_ms, double shift_ms);

/// Computes exp(mean of ln r) for ratios of times or costs. Empty: NaN. Throws InputError for ratios that are not
/// positive and finite.
double GeometricMean(std::span<const double> ratios);

/// Computes quantiles by linear interpolation between order statistics, at (n - 1) share from the smallest: type 7 of
/// Hyndman and Fan (1996, Am. Stat. 50:361), NumPy's default; share 1/2 is the median. +infinity is the largest value,
/// and a quantile between a number and +infinity is +infinity. Returns them in the order of `shares`, all NaN without
/// values. Any unit. Throws InputError for NaN and -infinity in values, and for shares outside [0, 1].
std::vector<double> Quantiles(std::span<const double> values, std::span<const double> shares);

}  // namespace legopt::statistics
