#pragma once

#include <span>
#include <vector>

/// Tests of more than two methods on the same problems. In every table a row is a problem and a column a method; rows
/// of problems that are missing in any method are left out by the caller.
namespace legopt::statistics {

/// The p-values of a family, adjusted so that the chance of any wrong rejection keeps its level (Holm 1979, Scand. J.
/// Stat. 6:65): sorted, p_(i) (m - i + 1), running maximum, at most 1. In the order of `p`; the family is what is shown
/// together. Empty: empty. Throws InputError for p outside of [0, 1].
std::vector<double> HolmAdjusted(std::span<const double> p);

/// Whether k methods differ in success.
struct CochranTest {
  int informative = 0;  ///< problems that some methods solved and some did not; 0: nothing to test; p is 1
  int degrees = 0;      ///< of freedom, k - 1
  double q = 0.0;       ///< (k - 1) (k sum C_j^2 - T^2) / (k T - sum R_i^2) with column, row sums and total of ones
  double p = 1.0;       ///< upper tail of chi-square; rough below some 24 informative cells
};

/// Cochran's Q (1950, Biometrika 37:256) before methods are compared by pairs with McNemar; with two methods it is
/// McNemar's chi-square. Entries are 1 (solved) or 0; fewer than two columns or no rows: nothing to test. Throws
/// InputError for other entries and rows of unequal length.
CochranTest CochranQ(std::span<const std::vector<int>> rows);

/// F of Iman and Davenport with its p.
struct ImanDavenportTest {
  int numerator = 0;    ///< degrees of freedom, k - 1
  int denominator = 0;  ///< (k - 1) (n - 1); 0: fewer than two problems, nothing to test; p is 1
  double f = 0.0;       ///< (n - 1) chi^2 / (n (k - 1) - chi^2); +infinity where all problems agree, with p = 0
  double p = 1.0;       ///< upper tail of F
};

/// Iman and Davenport (1980, Commun. Stat. A9:571), less conservative than the chi-square that it is made of. Fewer
/// than two methods or problems: nothing to test. Throws InputError for negative counts and for a `chi_square` outside
/// of [0, n (k - 1)], the values that Friedman's can take.
ImanDavenportTest ImanDavenport(double chi_square, int problems, int methods);

/// Whether k methods differ in their ranks.
struct FriedmanTest {
  std::vector<double> mean_ranks;  ///< per method, 1 is best (smallest values); empty without rows
  int problems = 0;                ///< n, the rows
  int degrees = 0;                 ///< of freedom, k - 1
  bool defined = false;            ///< false: no rows, one method, or all tied: nothing to test; p is 1
  double tie_correction = 1.0;     ///< 1 - sum(t^3 - t) / (n k (k^2 - 1)); 1 without ties, 0 when all are tied
  /// 12 n / (k (k + 1)) (sum R_j^2 - k (k + 1)^2 / 4) of the mean ranks R_j, divided by `tie_correction`. Demsar's
  /// figures have no such division.
  double chi_square = 0.0;
  double p = 1.0;                    ///< upper tail of chi-square; rough for few problems
  ImanDavenportTest iman_davenport;  ///< of the same chi-square
};

/// Test of Friedman (1937, JASA 32:675; Demsar 2006, JMLR 7:1, with F). Within each problem methods are ranked by their
/// values, smaller is better, ties share their mean rank; +infinity is a failure, ranked last. Mean ranks depend on
/// which other methods are in the table (Benavoli, Corani, Mangili 2016, JMLR 17(5)): whether A beats B is decided by
/// their pair alone, with HolmAdjusted over the pairs. Throws InputError for NaN, -infinity and rows of unequal length.
FriedmanTest Friedman(std::span<const std::vector<double>> rows);

}  // namespace legopt::statistics
