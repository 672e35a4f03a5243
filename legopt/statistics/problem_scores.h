#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace legopt::statistics {

/// Closed interval; either end may be infinite.
struct Interval {
  double lower = 0.0;
  double upper = 0.0;
};

/// Scores per problem, the unit of all statistics. Repetitions of a problem are not independent, so they are averaged
/// first. A repetition that was never run or was cancelled is missing, not failed.

/// Outcome of one repetition.
enum class RunOutcome : std::uint8_t {
  kSolved,   ///< the judge accepts its solution
  kFailed,   ///< finished without an accepted solution: failed, dead, or stopped at its time limit
  kMissing,  ///< queued, running or cancelled
};

/// One repetition of one problem by one method.
struct Repetition {
  RunOutcome end = RunOutcome::kMissing;
  /// Cost of the solution, or time in ms (also of failed runs); >= 0 and finite. Ignored for a missing run.
  double value = 0.0;
};

/// Sums over the repetitions of one problem by one method.
struct ProblemScore {
  int solved = 0;                                   ///< number of solved repetitions
  int failed = 0;                                   ///< number of failed repetitions
  int missing = 0;                                  ///< number of missing repetitions; excluded from all means
  double solved_sum = 0.0;                          ///< sum of the values of solved repetitions
  double failed_sum = 0.0;                          ///< sum of the values of failed repetitions
  int finished() const { return solved + failed; }  ///< number of repetitions that count; 0: the problem is missing

  /// solved / finished, in [0, 1]; NaN for a missing problem.
  double Share() const;
  /// Mean value of the solved repetitions, for costs and "solved only"; +infinity if there is none, NaN for a missing
  /// problem. It rewards failures, so report Share with it.
  double MeanSolvedValue() const;
  /// Returns the mean over the finished repetitions, where a failed one counts `charge` (>= 0; +infinity: one failure
  /// makes the problem unsolved); NaN for a missing problem. Throws InputError for a negative charge and NaN.
  double Charged(double charge) const;
  /// Mean value of the finished repetitions, failed ones included; NaN for a missing problem.
  double Spent() const;
};

/// Sums up the repetitions of one problem; none: a missing problem. Throws InputError if the value of a finished run is
/// negative or not finite.
ProblemScore ScoreOf(std::span<const Repetition> repetitions);

/// Returns the mean of ProblemScore::Charged over the problems that are not missing. With a charge of k time limits
/// this is PAR-k with repetitions (PenalisedAverage is for single runs). NaN if all are missing. Throws like Charged.
double MeanCharged(std::span<const ProblemScore> problems, double charge);

/// Paired outcomes of two methods on the same problems, each problem counted once. With several repetitions the solved
/// shares are compared, and only their order matters, as in a sign test.
struct PairCounts {
  int both = 0;         ///< equal shares above 0; with one repetition: solved by both
  int only_first = 0;   ///< the first method has the larger share; with one repetition: only the first solved it
  int only_second = 0;  ///< the second method has the larger share
  int neither = 0;      ///< solved by neither
  int missing = 0;      ///< missing for either method; excluded from all other counts

  int pairs() const { return both + only_first + only_second + neither; }  ///< number of problems that count
};

/// Counts paired outcomes; `first[i]` and `second[i]` belong to the same problem. Throws InputError for unequal
/// lengths.
PairCounts CountPairs(std::span<const ProblemScore> first, std::span<const ProblemScore> second);

/// Returns the indices of the problems that both methods solved at least once, for which costs, and times of solved
/// runs, are comparable. Throws InputError for unequal lengths.
std::vector<int> CommonlySolved(std::span<const ProblemScore> first, std::span<const ProblemScore> second);

/// Mean times that include the cost of failures. Times are in ms, one per problem, averaged over repetitions
/// (ProblemScore); where allowed, +infinity is an unsolved problem. Without problems every mean is NaN, which tables
/// show as a dash.

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
