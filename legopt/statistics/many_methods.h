#pragma once

#include <span>
#include <vector>

/// Tests of more than two methods on the same problems. In every table a row is a problem and a column a method; the
/// caller omits problems that are missing for any method.
namespace legopt::statistics {

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
