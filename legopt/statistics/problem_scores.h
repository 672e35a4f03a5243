#pragma once

#include <cstdint>
#include <span>
#include <vector>

/// The unit of every statistic is the problem. Repetitions of one problem are not independent of each other, so they
/// are averaged first; what was never run, or was cancelled, is missing and no failure.
namespace legopt::statistics {

/// How one repetition ended.
enum class RunEnd : std::uint8_t {
  kSolved,   ///< the judge accepts its solution
  kFailed,   ///< it ran and has no accepted solution: failed, dead, or stopped at its time limit
  kMissing,  ///< queued, running or cancelled: nothing is known of it
};

/// One repetition of one problem by one method.
struct Repetition {
  RunEnd end = RunEnd::kMissing;  ///< how it ended
  /// Cost of the solution, or time in ms, also of a failed run; >= 0 and finite. Not read of a missing run.
  double value = 0.0;
};

/// One problem of one method, its repetitions added up.
struct ProblemScore {
  int solved = 0;                                   ///< repetitions that solved it
  int failed = 0;                                   ///< that did not
  int missing = 0;                                  ///< of which nothing is known; they enter no mean
  double solved_sum = 0.0;                          ///< of the values of solved repetitions
  double failed_sum = 0.0;                          ///< of the values of failed ones
  int finished() const { return solved + failed; }  ///< repetitions that count; 0: the problem is missing

  /// solved / finished, in [0, 1]; NaN of a missing problem.
  double Share() const;
  /// Mean value of the solved repetitions, for costs and "solved only"; +infinity when there is none, NaN of a missing
  /// problem. It rewards failing: Share belongs beside it.
  double MeanOfSolved() const;
  /// Mean over the finished repetitions, where a failed one costs `charge` (>= 0; +infinity: one failure makes the
  /// problem never solved); NaN of a missing problem. Throws InputError for a negative charge and NaN.
  double Charged(double charge) const;
  /// Mean over the finished repetitions of what was spent, failed ones included; NaN of a missing problem.
  double Spent() const;
};

/// Adds up the repetitions of one problem; none: a missing problem. Throws InputError for a value of a finished run
/// that is negative or not finite.
ProblemScore ScoreOf(std::span<const Repetition> repetitions);

/// Mean of ProblemScore::Charged over the problems that are not missing: PAR-k of problems with repetitions for a
/// charge of k time limits (PenalisedAverage is that of single runs). NaN where all are missing. Throws as Charged.
double MeanCharged(std::span<const ProblemScore> problems, double charge);

/// How two methods did on the same problems, each problem counted once. With several repetitions the shares of solved
/// ones are compared, so that only their order decides, as in a sign test.
struct PairCounts {
  int both = 0;         ///< equal shares above 0; with one repetition: solved by both
  int only_first = 0;   ///< larger share of the first; with one repetition: solved by it alone
  int only_second = 0;  ///< larger share of the second
  int neither = 0;      ///< solved by none
  int missing = 0;      ///< missing in either: in no other count

  int pairs() const { return both + only_first + only_second + neither; }  ///< problems that count
};

/// Counts problems; `first[i]` and `second[i]` are of the same problem. Throws InputError for unequal lengths.
PairCounts CountPairs(std::span<const ProblemScore> first, std::span<const ProblemScore> second);

/// Indices of the problems that both have solved at least once: where costs, and times of solved runs, are comparable.
/// Throws InputError for unequal lengths.
std::vector<int> CommonlySolved(std::span<const ProblemScore> first, std::span<const ProblemScore> second);

}  // namespace legopt::statistics
