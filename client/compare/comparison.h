#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/compare/charge.h"
#include "client/compare/solves.h"
#include "legopt/statistics/paired_tests.h"
#include "legopt/statistics/profiles.h"
#include "legopt/statistics/proportions.h"
#include "words/comparison.h"

/// Two methods on the same problems. Everything is said of B beside A: differences are B - A, ratios B / A.
namespace legopt::client {

/// Level of every interval, and what an adjusted p must be below for a difference to be one.
inline constexpr double kLevel = 0.95, kSignificance = 0.05;

/// A problem that both have finished, its repetitions added up.
struct ProblemPair {
  ProblemRuns a, b;
};

/// The middle of ratios by Hodges and Lehmann, of their logarithms.
struct TypicalRatio {
  double estimate = 1.0;
  statistics::Interval interval;  ///< 0 to infinity where there are too few problems for the level
  double coverage = 1.0;          ///< that it has, at least kLevel
};

/// How ratios lie on the problems that both solved.
struct RatioComparison {
  int n = 0;                            ///< problems that both solved and whose ratio is defined
  double mean = 1.0;                    ///< geometric mean; NaN: n is 0
  statistics::Interval interval;        ///< BCa; percentiles beyond 5,000 problems
  std::optional<TypicalRatio> typical;  ///< none of no problems and of more than 3,000
  statistics::SignedRankTest test;      ///< of logarithms of times, of differences of costs
  double adjusted_p = 1.0;              ///< Holm, over all comparisons that are shown
  int lower = 0;                        ///< problems on which B is faster, cheaper
  Change change = Change::kNone;
};

/// Times of one problem, means of solved repetitions; infinite where none was solved.
struct PairedTimes {
  int problem = 0;
  double a_ms = 0.0, b_ms = 0.0;
};

/// One problem that stands out.
struct ProblemRatio {
  int problem = 0;
  std::int64_t job_a = 0, job_b = 0;  ///< first repetitions
  double ratio = 1.0;                 ///< of times
};

/// Success of both.
struct SuccessComparison {
  statistics::PairCounts counts;  ///< first: A
  double share_a = 0.0, share_b = 0.0;
  statistics::ShareDifference difference;  ///< Newcombe's; with repetitions by bootstrap over problems
  statistics::McNemarTest test;
  double adjusted_p = 1.0;
  Change change = Change::kNone;
};

/// One method beside another on one task from one start.
struct CellComparison {
  MethodIdentity a, b;
  BenchmarkColumn column;
  double limit_ms = 0.0;             ///< the smaller one; what took longer counts as failed where limits differ
  int only_in_a = 0, only_in_b = 0;  ///< problems that the other was not asked to solve
  SuccessComparison success;
  RatioComparison time, cost;
  Charge charge;                               ///< of a failed run
  double par10_a_ms = 0.0, par10_b_ms = 0.0;   ///< mean times, a failed run at the charge
  statistics::Interval par10_ratio;            ///< BCa
  statistics::Dominance dominance{};           ///< of the runtime distributions, failures at infinity; first: A
  std::optional<double> crossing_ms;           ///< where the one that leads first is first overtaken
  double contended_share = 0.0;                ///< of the runs of both
  std::vector<PairedTimes> times;              ///< of the pairs, by problem
  std::vector<ProblemRatio> fastest, slowest;  ///< of B: the smallest ratios below 1, the largest above it
  Change change = Change::kNone;
};

/// How much a ratio must differ from 1 to be told, e.g. 0.05.
struct ComparisonOptions {
  double margin = 0.0;     ///< >= 0
  std::uint64_t seed = 1;  ///< of the bootstrap
};

/// Compares two cells of one task and start of one dataset, all but what needs the whole family. No pairs when they
/// have no problem in common that both have finished.
CellComparison CompareCells(const SolveCell& a, const SolveCell& b, const Charge& charge,
                            const ComparisonOptions& options);

/// Adjusts the p of all cells that are shown together, each of the three tests for itself, and decides (see
/// docs/statistics.md): success first; else time and cost, each only where its interval and its adjusted p agree.
void Decide(const ComparisonOptions& options, std::vector<CellComparison>* cells);

/// Of all cells.
Change OverallChange(const std::vector<CellComparison>& cells);

/// The fewest problems that only one of two methods solved for which McNemar's mid-p can be below kSignificance.
int LeastDiscordant();

}  // namespace legopt::client
