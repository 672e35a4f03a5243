#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "legopt/statistics/problem_scores.h"

namespace legopt::statistics {

/// Ranks of values, with the sum for tie corrections.
struct Ranks {
  std::vector<double> ranks;  ///< 1 for the smallest; equal values share the mean of their ranks
  double tie_sum = 0.0;       ///< sum of t^3 - t over groups of t equal values; 0 without ties
};

/// Computes mid-ranks. Values are tied if they are equal as doubles, so callers should round them to their significant
/// digits; +infinity ties with itself. Throws InputError for NaN and -infinity.
Ranks MidRanks(std::span<const double> values);

/// Computes the score interval of Wilson (1927, JASA 22:209; Newcombe 1998, Stat. Med. 17:857) for a share of problems.
/// With p = successes / problems and z the quantile of the level, its middle is (p + z^2/2n) / (1 + z^2/n) and its half
/// width z / (1 + z^2/n) sqrt(p (1 - p)/n + z^2/4n^2). For 50 of 50, the lower end is 92.9 %.
///
/// `successes` may be fractional, the sum of the problems' shares of solved repetitions. Such shares vary less than
/// zeros and ones, so that the interval is then conservative. No problems: [0, 1]. Throws InputError for negative
/// numbers, more successes than problems, and a `level` outside (0, 1).
Interval WilsonInterval(double successes, int problems, double level = 0.95);

/// Difference of two shares with its confidence interval.
struct ShareDifference {
  double estimate = 0.0;  ///< share of the first minus share of the second, in [-1, 1]
  Interval interval;      ///< within [-1, 1]
};

/// Computes the difference in success of two methods on the same problems by method 10 of Newcombe (1998, Stat. Med.
/// 17:2635). It combines the Wilson intervals of both shares with the correlation phi of the successes, whose numerator
/// ad - bc is lowered by n/2 (not below 0) if positive; phi = 0 if a margin is empty. With l, u the ends of the
/// intervals and d1 = p1 - l1, d2 = u2 - p2 the lower end is p1 - p2 - sqrt(d1^2 - 2 phi d1 d2 + d2^2); the upper end
/// is symmetric. No pairs: 0 in [-1, 1]. Throws InputError for negative counts and a `level` outside (0, 1).
ShareDifference PairedShareDifference(const PairCounts& counts, double level = 0.95);

/// Result of McNemar's test: does one of two methods solve more problems?
struct McNemarTest {
  int discordant = 0;    ///< problems that exactly one method solved; 0: no test, print a dash; both p are 1
  double exact_p = 1.0;  ///< two-sided, min(1, 2 P(X <= min(b, c))), X ~ Bin(b + c, 1/2)
  double mid_p = 1.0;    ///< recommended: exact_p - P(X = min(b, c)), and 1 - P(X = b)/2 for b = c
};

/// Computes McNemar's test (1947, Psychometrika 12:153) for b problems solved by the first method only and c by the
/// second only; problems solved by both or neither are irrelevant. Fagerland, Lydersen and Laake (2013, BMC Med. Res.
/// Methodol. 13:91) recommend the mid-p and advise against the exact p, which is too conservative: with all discordant
/// problems on one side, it needs 6 of them for p < 0.05, the mid-p 5. Throws InputError for negative counts.
McNemarTest McNemar(int only_first, int only_second);

/// Result of a sign-flip permutation test: are paired differences centred at zero?
struct PermutationTest {
  int pairs = 0;      ///< number of non-zero differences; 0: no test, print a dash; p is 1
  double p = 1.0;     ///< two-sided: share of all 2^pairs sign patterns whose |sum| is at least the observed one
  bool exact = true;  ///< false: p is by the normal distribution, since there are too many sums
};

/// Computes Fisher's permutation test of paired differences (1935, The Design of Experiments, section 21). The
/// differences are integers, such as numbers of solved repetitions. Unlike a sign test, a problem counts by the size of
/// its difference. Exact if pairs times the sum of |d| is at most 2e8. Throws InputError for a sum of |d| above 2^30.
PermutationTest SignFlip(std::span<const int> differences);

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

/// Tests of more than two methods on the same problems. In every table a row is a problem and a column a method; the
/// caller omits problems that are missing for any method.

/// Adjusts the p-values of a family so that the probability of any wrong rejection keeps its level (Holm 1979, Scand.
/// J. Stat. 6:65): sorted, p_(i) (m - i + 1), running maximum, at most 1. Returns them in the order of `p`. The family
/// is all tests that are shown together. Throws InputError for p outside [0, 1].
std::vector<double> HolmAdjusted(std::span<const double> p);

/// Result of Cochran's test: do k methods differ in success?
struct CochranTest {
  int informative = 0;  ///< problems that some methods solved and some did not; 0: no test, p is 1
  int degrees = 0;      ///< degrees of freedom, k - 1
  double q = 0.0;       ///< (k - 1) (k sum C_j^2 - T^2) / (k T - sum R_i^2) with column sums C_j, row sums R_i and
                        ///< total T of ones
  double p = 1.0;       ///< upper tail of chi-square; inaccurate below about 24 informative cells
};

/// Computes Cochran's Q (1950, Biometrika 37:256), before pairs of methods are compared with McNemar; for two methods
/// it is McNemar's chi-square. Entries are 1 (solved) or 0. Fewer than two columns or no rows: no test. Throws
/// InputError for other entries and rows of unequal length.
CochranTest CochranQ(std::span<const std::vector<int>> rows);

/// F statistic of Iman and Davenport with its p-value.
struct ImanDavenportTest {
  int numerator = 0;    ///< degrees of freedom, k - 1
  int denominator = 0;  ///< (k - 1) (n - 1); 0: fewer than two problems, no test, p is 1
  double f = 0.0;       ///< (n - 1) chi^2 / (n (k - 1) - chi^2); +infinity if all problems agree, with p = 0
  double p = 1.0;       ///< upper tail of F
};

/// Computes the test of Iman and Davenport (1980, Commun. Stat. A9:571), which is less conservative than Friedman's
/// chi-square, its input. Fewer than two methods or problems: no test. Throws InputError for negative counts and for a
/// `chi_square` outside [0, n (k - 1)], the range of Friedman's.
ImanDavenportTest ImanDavenport(double chi_square, int problems, int methods);

/// Result of Friedman's test: do k methods differ in their ranks?
struct FriedmanTest {
  std::vector<double> mean_ranks;  ///< per method, 1 is best (smallest values); empty without rows
  int problems = 0;                ///< n, number of rows
  int degrees = 0;                 ///< degrees of freedom, k - 1
  bool defined = false;            ///< false without rows, with one method, or if all are tied: no test, p is 1
  double tie_correction = 1.0;     ///< 1 - sum(t^3 - t) / (n k (k^2 - 1)); 1 without ties, 0 if all are tied
  /// 12 n / (k (k + 1)) (sum R_j^2 - k (k + 1)^2 / 4) of the mean ranks R_j, divided by `tie_correction`. Demsar's
  /// numbers omit this division.
  double chi_square = 0.0;
  double p = 1.0;                    ///< upper tail of chi-square; inaccurate for few problems
  ImanDavenportTest iman_davenport;  ///< F test for `chi_square`
};

/// Computes Friedman's test (1937, JASA 32:675; Demsar 2006, JMLR 7:1, with F). Methods are ranked by value within each
/// problem; smaller is better, ties share their mean rank, and +infinity is a failure, ranked last. Mean ranks depend
/// on the other methods in the table (Benavoli, Corani, Mangili 2016, JMLR 17(5)): to decide whether A beats B, test
/// the pair alone, with HolmAdjusted over all pairs. Throws InputError for NaN, -infinity and rows of unequal length.
FriedmanTest Friedman(std::span<const std::vector<double>> rows);

}  // namespace legopt::statistics
