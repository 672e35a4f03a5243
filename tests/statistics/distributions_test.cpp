// Policy: closed forms, printed tables, and each function against its inverse or complement; SciPy's values are in
// scipy_cases_test.cpp.

#include "legopt/statistics/distributions.h"

#include <cmath>
#include <limits>

#include "legopt/statistics/checks.h"
#include "tests/statistics/refusal.h"

namespace legopt::statistics {
namespace {

TEST(Distributions, NormalQuantileInvertsTheTailsFarOut) {
  for (const double p : {1e-300, 1e-100, 1e-16, 1e-8, 0.001, 0.02425, 0.3, 0.4999999, 0.5}) {
    const double z = NormalQuantile(p);
    EXPECT_NEAR(NormalCdf(z) / p, 1.0, 1e-11) << p;
    EXPECT_NEAR(NormalUpperTail(-z) / p, 1.0, 1e-11) << p;
  }
  EXPECT_DOUBLE_EQ(NormalQuantile(0.25), -NormalQuantile(0.75));
  EXPECT_EQ(NormalQuantile(0.5), 0.0);
  EXPECT_EQ(NormalQuantile(0.0), -kInfinity);
  EXPECT_EQ(NormalQuantile(1.0), kInfinity);
  EXPECT_EQ(NormalCdf(kInfinity), 1.0);
}

TEST(Distributions, FairCoinIsExact) {
  EXPECT_EQ(FairCoinPmf(0, 0), 1.0);
  EXPECT_EQ(FairCoinCdf(0, 0), 1.0);
  EXPECT_EQ(FairCoinPmf(2, 4), 0.375);
  EXPECT_EQ(FairCoinCdf(1, 8), 9.0 / 256.0);
  EXPECT_EQ(FairCoinPmf(3, 60), FairCoinPmf(57, 60));
  for (const int n : {1, 7, 40, 301, 2000}) {
    double sum = 0.0;
    for (int k = 0; k <= n; ++k) {
      sum += FairCoinPmf(k, n);
      EXPECT_NEAR(FairCoinCdf(k, n), sum, 1e-13) << k << " of " << n;
    }
  }
  EXPECT_GT(FairCoinPmf(0, 1000), 0.0);  // 2^-1000
  EXPECT_EQ(FairCoinPmf(0, 100'000), 0.0);
  EXPECT_NEAR(FairCoinPmf(50'000, 100'000), 0.0025231262141967, 1e-13);
}

TEST(Distributions, ChiSquareHasItsClosedForms) {
  for (const double x : {1e-9, 0.1, 1.0, 7.0, 300.0}) {
    EXPECT_NEAR(ChiSquareUpperTail(x, 2) / std::exp(-x / 2.0), 1.0, 1e-12) << x;
    EXPECT_NEAR(ChiSquareUpperTail(x, 1) / (2.0 * NormalUpperTail(std::sqrt(x))), 1.0, 1e-12) << x;
  }
  EXPECT_EQ(ChiSquareUpperTail(0.0, 5), 1.0);
  EXPECT_EQ(ChiSquareUpperTail(kInfinity, 5), 0.0);
  EXPECT_NEAR(ChiSquareUpperTail(18.307038, 10), 0.05, 1e-8);  // any printed table
}

TEST(Distributions, FHasItsClosedForms) {
  for (const double f : {0.01, 0.5, 1.0, 3.0, 50.0}) {
    EXPECT_NEAR(FUpperTail(f, 2, 10) / std::pow(1.0 + 2.0 * f / 10.0, -5.0), 1.0, 1e-12) << f;
    EXPECT_NEAR(FUpperTail(f, 3, 7), 1.0 - FUpperTail(1.0 / f, 7, 3), 1e-13) << f;
    EXPECT_NEAR(FUpperTail(f, 1, 1), 1.0 - 2.0 / std::acos(-1.0) * std::atan(std::sqrt(f)), 1e-13) << f;
  }
  EXPECT_NEAR(FUpperTail(2.845, 3, 39), 0.05, 1e-4);  // critical F(3, 39) = 2.85 of Demsar 2006
  EXPECT_NEAR(FUpperTail(1.5, 4, 2'000'000), ChiSquareUpperTail(6.0, 4), 1e-6);
  EXPECT_EQ(FUpperTail(0.0, 3, 4), 1.0);
  EXPECT_EQ(FUpperTail(kInfinity, 3, 4), 0.0);
}

TEST(Distributions, RefuseWhatIsOutOfRange) {
  EXPECT_REFUSED(NormalQuantile(1.5), "NormalQuantile: p: must lie in [0, 1] (got '1.5')");
  EXPECT_REFUSED(NormalQuantile(kNaN), "NormalQuantile");
  EXPECT_REFUSED(FairCoinPmf(4, 3), "k: must lie in [0, n] (got '4')");
  EXPECT_REFUSED(FairCoinCdf(0, -1), "n: must not be below 0");
  EXPECT_REFUSED(ChiSquareUpperTail(-1.0, 2), "x: must not be negative");
  EXPECT_REFUSED(ChiSquareUpperTail(kNaN, 2), "x");
  EXPECT_REFUSED(ChiSquareUpperTail(1.0, 0), "degrees");
  EXPECT_REFUSED(FUpperTail(-1.0, 2, 2), "f: must not be negative");
  EXPECT_REFUSED(FUpperTail(1.0, 2, 0), "denominator");
}

}  // namespace
}  // namespace legopt::statistics
