#pragma once

#include <cstdint>
#include <span>

#include "legopt/statistics/interval.h"

namespace legopt::statistics {

/// Treatment of pairs without a difference.
enum class ZeroRule : std::uint8_t {
  kDrop,   ///< removed before the others are ranked (Wilcoxon 1945)
  kPratt,  ///< ranked lowest, then removed (Pratt 1959, JASA 54:655)
};

/// Options of a signed rank test.
struct SignedRankOptions {
  ZeroRule zeros = ZeroRule::kDrop;
  int max_exact_pairs = 200;  ///< p is exact up to this number of non-zero differences, 0..1000
};

/// Result of a signed rank test: are the differences centred at zero?
struct SignedRankTest {
  int pairs = 0;              ///< number of non-zero differences; 0: no test, print a dash; every p is 1
  int zeros = 0;              ///< number of zero differences
  double positive_sum = 0.0;  ///< sum of the ranks of |d| over d > 0, R's V; Wilcoxon's T is the smaller sum
  double negative_sum = 0.0;  ///< sum of the ranks of |d| over d < 0
  double greater_p = 1.0;     ///< one-sided: differences tend to be positive
  double less_p = 1.0;        ///< one-sided: differences tend to be negative
  double two_sided_p = 1.0;   ///< min(1, twice the smaller one-sided p)
  bool exact = true;          ///< p by enumeration of all signs, not by the normal approximation
};

/// Computes the signed rank test of Wilcoxon (1945, Biometrics Bull. 1:80) for paired differences, one per problem that
/// both methods solved: of costs, or of logarithms of times. |d| are ranked, ties share their mean rank. The exact p
/// counts all 2^pairs signs by dynamic programming over doubled ranks, which are integers even with ties. Beyond
/// `max_exact_pairs` the sum is taken as normal with mean sum(r)/2 and variance sum(r^2)/4, which includes ties and
/// Pratt's zeros, without continuity correction.
///
/// Any unit. Differences are tied if their magnitudes are equal as doubles, so round them to their significant digits.
/// The result does not depend on their order. Throws InputError for NaN, infinities and options out of range.
SignedRankTest SignedRank(std::span<const double> differences, const SignedRankOptions& options = {});

/// Location (pseudo-median) of differences.
struct Location {
  double estimate = 0.0;  ///< median of the Walsh averages (d_i + d_j)/2, i <= j; NaN without differences
  Interval interval;      ///< infinite if there are too few differences for the level (95 %: fewer than 6)
  double coverage = 1.0;  ///< actual coverage under symmetry without ties: at least the requested level
};

/// Maximum number of differences n for HodgesLehmann, which stores n (n + 1)/2 numbers.
inline constexpr int kMaxHodgesLehmann = 10'000;

/// Computes the estimate of Hodges and Lehmann (1963, Ann. Math. Stat. 34:598) with Tukey's interval: the values that
/// the signed rank test does not reject, from the C-th smallest to the C-th largest Walsh average. C is the largest
/// number for which P(V < C) <= (1 - level)/2, exact up to 200 differences, normal beyond. For logarithms of time
/// ratios, exp(estimate) is the typical ratio. Zeros and ties are not treated specially. Unit: that of the differences.
/// Throws InputError for NaN, infinities, more than kMaxHodgesLehmann differences, and a `level` outside (0, 1).
Location HodgesLehmann(std::span<const double> differences, double level = 0.95);

}  // namespace legopt::statistics
