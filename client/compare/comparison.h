#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/solves.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/profiles.h"
#include "legopt/types/experiment.h"

/// Comparison of two methods on the same problems. All values describe B relative to A: differences are B - A, ratios B
/// / A.
namespace legopt::client {

/// Significance level of adjusted p-values, and probability that any interval of a family misses its value.
inline constexpr double kSignificance = 0.05;

/// A problem that both methods have finished, with its repetitions summed.
struct ProblemPair {
  ProblemRuns a, b;
};

/// Hodges-Lehmann estimate of the central ratio, computed from logarithms.
struct TypicalRatio {
  double estimate = 1.0;
  statistics::Interval interval;  ///< 0 to infinity if there are too few problems for the level
  double coverage = 1.0;          ///< actual coverage, at least ComparisonOptions::level()
};

/// Comparison of ratios on the problems that both methods solved.
struct RatioComparison {
  int n = 0;                            ///< number of problems that both solved and whose ratio is defined
  double mean = 1.0;                    ///< geometric mean; NaN if n is 0
  statistics::Interval interval;        ///< BCa; percentiles above 5,000 problems
  std::optional<TypicalRatio> typical;  ///< nullopt without problems and above 3,000
  statistics::SignedRankTest test;      ///< test of logarithms of times, or differences of costs
  double adjusted_p = 1.0;              ///< Holm-adjusted over the family
  int lower = 0;                        ///< number of problems on which B has less work, is faster or cheaper
  ComparisonResult change = ComparisonResult::kNone;
};

/// Times of a problem: means of solved repetitions; infinite if none was solved.
struct PairedTimes {
  int problem = 0;
  double a_ms = 0.0, b_ms = 0.0;
};

/// A problem with an extreme ratio.
struct ProblemRatio {
  int problem = 0;
  std::int64_t job_a = 0, job_b = 0;  ///< first repetitions
  double ratio = 1.0;                 ///< ratio of times
};

/// Comparison of success.
struct SuccessComparison {
  statistics::PairCounts counts;  ///< first method: A
  double share_a = 0.0, share_b = 0.0;
  statistics::ShareDifference difference;  ///< Newcombe's interval; with repetitions by bootstrap over problems
  statistics::McNemarTest test;
  /// Test of the shares of solved repetitions; nullopt without repetitions, where McNemar's test decides.
  std::optional<statistics::PermutationTest> repeated;
  double adjusted_p = 1.0;

  double p() const { return repeated ? repeated->p : test.mid_p; }  ///< p of the test that decides
  ComparisonResult change = ComparisonResult::kNone;
};

/// Comparison of two methods on one task and initialization.
struct CellComparison {
  MethodIdentity a, b;
  BenchmarkColumn column;
  double limit_ms = 0.0;             ///< the smaller limit; if the limits differ, longer runs count as failed
  int only_in_a = 0, only_in_b = 0;  ///< numbers of problems that the other was not asked to solve
  SuccessComparison success;
  RatioComparison work, time, cost;            ///< work.n is 0 if it was not counted on all problems that both solved
  double time_margin = 0.0;                    ///< minimum deviation of the ratio of times from 1 to be reported
  Charge charge;                               ///< charge of a failed run
  double par10_a_ms = 0.0, par10_b_ms = 0.0;   ///< mean times, with failed runs at the charge
  statistics::Interval par10_ratio;            ///< BCa
  statistics::Dominance dominance{};           ///< dominance of the runtime distributions, failures at infinity; first
                                               ///< method: A
  std::optional<double> crossing_ms;           ///< first time at which the leading method is overtaken
  double contended_share = 0.0;                ///< share of disturbed runs of both
  std::vector<PairedTimes> times;              ///< times of the pairs, by problem
  std::vector<ProblemRatio> fastest, slowest;  ///< extreme time ratios: the smallest below 1, the largest above 1
  ComparisonResult change = ComparisonResult::kNone;
};

/// Options of a comparison.
struct ComparisonOptions {
  double margin = 0.0;  ///< minimum deviation of a ratio from 1 to be reported, e.g. 0.05; >= 0; that of times may be
                        ///< larger (RaiseTimeMargins)
  std::uint64_t seed = 1;  ///< seed of the bootstrap
  int family = 1;          ///< number of comparisons that are shown together, also in other tables, >= 1

  /// Confidence level of one interval. Nominally, all intervals of one kind in the family contain their values with
  /// probability 0.95 (Bonferroni).
  double level() const { return 1.0 - kSignificance / family; }
};

/// Returns the number of problems that both cells have finished.
int NumCommonProblems(const SolveCell& a, const SolveCell& b);

/// Compares two cells of the same task, initialization and dataset, except for values that need all cells. The result
/// has no pairs if both have finished no common problem.
CellComparison CompareCells(const SolveCell& a, const SolveCell& b, const Charge& charge,
                            const ComparisonOptions& options);

/// Adjusts the p-values of the cells for the whole family, separately for each of the four tests, and sets the changes
/// (see docs/explanation/statistics.md): success first; otherwise work and cost, each only if its interval and its
/// adjusted p-value agree. Time decides only where work was not counted: it depends on load and machine.
void Decide(const ComparisonOptions& options, std::vector<CellComparison>* cells);

/// Returns the overall change of all cells.
ComparisonResult OverallChange(const std::vector<CellComparison>& cells);

/// Returns the smallest number of problems solved by only one of two methods for which McNemar's mid-p can be below
/// kSignificance.
int MinDiscordantPairs();

}  // namespace legopt::client
