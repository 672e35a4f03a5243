#pragma once

#include <cstdint>
#include <span>

#include "legopt/statistics/interval.h"

namespace legopt::statistics {

/// What becomes of pairs without a difference.
enum class ZeroRule : std::uint8_t {
  kDrop,   ///< they leave before the others are ranked (Wilcoxon 1945)
  kPratt,  ///< they are ranked, the lowest, and leave then (Pratt 1959, JASA 54:655)
};

/// How a signed rank test is made.
struct SignedRankOptions {
  ZeroRule zeros = ZeroRule::kDrop;  ///< of pairs without a difference
  int most_exact_pairs = 200;        ///< up to so many pairs with a difference p is exact, 0..1000; 0: never
};

/// Whether differences lean to one side of zero.
struct SignedRankTest {
  int pairs = 0;              ///< with a difference; 0: nothing to test, print a dash; every p is 1
  int zeros = 0;              ///< without one
  double positive_sum = 0.0;  ///< sum of the ranks of |d| over d > 0, R's V; Wilcoxon's T is the smaller sum
  double negative_sum = 0.0;  ///< over d < 0
  double greater_p = 1.0;     ///< one-sided: differences tend to be positive
  double less_p = 1.0;        ///< one-sided: they tend to be negative
  double two_sided_p = 1.0;   ///< min(1, twice the smaller of both)
  bool exact = true;          ///< p by enumeration of all signs, not by the normal approximation
};

/// Signed rank test of Wilcoxon (1945, Biometrics Bull. 1:80) on the differences of pairs, one per problem that both
/// methods solved: of costs, or of logarithms of times. |d| are ranked, ties share their mean rank. The exact p counts
/// all 2^pairs signs by dynamic programming over doubled ranks, which are whole numbers also when tied, so that it is
/// exact with ties, too. Beyond `most_exact_pairs` the sum is taken as normal with mean sum(r)/2 and variance
/// sum(r^2)/4, which includes ties and Pratt's zeros; no correction for continuity.
///
/// Unit: any; differences are tied when their magnitudes are equal as doubles, so round them to what they can be
/// trusted to. The result does not depend on their order. Throws InputError for NaN, infinities and options out of
/// range.
SignedRankTest SignedRank(std::span<const double> differences, const SignedRankOptions& options = {});

/// Where the middle of differences lies.
struct Location {
  double estimate = 0.0;  ///< median of the Walsh averages (d_i + d_j)/2, i <= j; NaN of no differences
  Interval interval;      ///< whole line where there are too few differences for the level (95 %: fewer than 6)
  double coverage = 1.0;  ///< what the interval has under symmetry without ties: at least the level that was asked for
};

/// Most differences that HodgesLehmann takes; it holds n (n + 1)/2 numbers.
inline constexpr int kMostLocated = 10'000;

/// Estimate of Hodges and Lehmann (1963, Ann. Math. Stat. 34:598) with the interval of Tukey: the values that the
/// signed rank test does not reject, from the C-th smallest to the C-th largest Walsh average, with C the largest
/// number for which P(V < C) <= (1 - level)/2, exact up to 200 differences, normal beyond. Of logarithms of time
/// ratios, its exp is the typical ratio. Zeros and ties count as they stand. Unit: that of the differences. Throws
/// InputError for NaN, infinities, more than kMostLocated differences, and a `level` outside of (0, 1).
Location HodgesLehmann(std::span<const double> differences, double level = 0.95);

}  // namespace legopt::statistics
