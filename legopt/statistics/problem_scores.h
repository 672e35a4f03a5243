#pragma once

#include <cstdint>
#include <span>
#include <vector>

/// Scores per problem, the unit of all statistics. Repetitions of a problem are not independent, so they are averaged
/// first. A repetition that was never run or was cancelled is missing, not failed.
namespace legopt::statistics {

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

}  // namespace legopt::statistics
