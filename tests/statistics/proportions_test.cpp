// Policy: published examples to their printed digits, coverage summed exactly or by simulation, and a defined result
// if there is nothing to compute.

#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <random>

#include "legopt/math/random_numbers.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "tests/statistics/refusal.h"

namespace legopt::statistics {
namespace {

void ExpectWilson(int successes, int problems, double lower, double upper, double tolerance) {
  const Interval interval = WilsonInterval(successes, problems);
  EXPECT_NEAR(interval.lower, lower, tolerance) << successes << "/" << problems;
  EXPECT_NEAR(interval.upper, upper, tolerance) << successes << "/" << problems;
}

// Newcombe 1998, Stat. Med. 17:857, table I.
TEST(Wilson, HasNewcombesFigures) {
  constexpr double kPrinted = 5e-5;
  ExpectWilson(81, 263, 0.2553, 0.3662, kPrinted);
  ExpectWilson(15, 148, 0.0624, 0.1605, kPrinted);
  ExpectWilson(0, 20, 0.0, 0.1611, kPrinted);
  ExpectWilson(1, 29, 0.0061, 0.1718, kPrinted);
}

TEST(Wilson, OfCellsOfABenchmark) {
  constexpr double kDigits = 5e-7;
  ExpectWilson(49, 50, 0.895046, 0.996461, kDigits);
  ExpectWilson(50, 50, 0.928652, 1.0, kDigits);
  ExpectWilson(35, 35, 0.901099, 1.0, kDigits);
  ExpectWilson(4, 4, 0.510109, 1.0, kDigits);
}

TEST(Wilson, EndsAreExactAtNoneAndAll) {
  EXPECT_EQ(WilsonInterval(0.0, 7).lower, 0.0);
  EXPECT_EQ(WilsonInterval(7.0, 7).upper, 1.0);
  EXPECT_EQ(WilsonInterval(0.0, 0).lower, 0.0);
  EXPECT_EQ(WilsonInterval(0.0, 0).upper, 1.0);
}

TEST(Wilson, IsSymmetricAndHoldsItsShare) {
  for (double x = 0.0; x <= 30.0; x += 0.25) {  // includes fractional sums of shares
    const Interval interval = WilsonInterval(x, 30, 0.9);
    const Interval mirrored = WilsonInterval(30.0 - x, 30, 0.9);
    EXPECT_NEAR(interval.lower, 1.0 - mirrored.upper, 1e-15);
    EXPECT_LE(interval.lower, x / 30.0);
    EXPECT_GE(interval.upper, x / 30.0);
    EXPECT_LT(interval.upper - interval.lower, WilsonInterval(x, 30, 0.99).upper - WilsonInterval(x, 30, 0.99).lower);
  }
}

TEST(Wilson, CoversOnAverageWhatItSays) {
  for (const int n : {10, 50}) {
    double mean = 0.0;
    constexpr int kGrid = 199;
    for (int step = 1; step <= kGrid; ++step) {
      const double p = static_cast<double>(step) / (kGrid + 1);
      double point = std::pow(1.0 - p, n);
      for (int x = 0; x <= n; ++x) {
        const Interval interval = WilsonInterval(x, n);
        if (interval.lower <= p && p <= interval.upper) mean += point / kGrid;
        point *= static_cast<double>(n - x) / (x + 1) * p / (1.0 - p);
      }
    }
    EXPECT_NEAR(mean, 0.95, 0.007) << n;  // Brown, Cai, DasGupta 2001, figure 5
  }
}

TEST(Wilson, RefusesBadInput) {
  EXPECT_REFUSED(WilsonInterval(5.0, 4), "WilsonInterval: successes: must lie between 0 and the number of problems");
  EXPECT_REFUSED(WilsonInterval(-1.0, 4), "got '-1'");
  EXPECT_REFUSED(WilsonInterval(std::nan(""), 4), "got 'nan'");
  EXPECT_REFUSED(WilsonInterval(0.0, -1), "problems: must not be below 0 (got '-1')");
  EXPECT_REFUSED(WilsonInterval(1.0, 4, 1.0), "level: must lie between 0 and 1 (got '1')");
}

// Airway hyper-responsiveness before and after transplantation (Bentur et al. 2009), the interval as in Fagerland,
// Lydersen, Laake 2014, Stat. Med. 33:2850.
TEST(PairedShareDifference, HasFagerlandsFigures) {
  const ShareDifference difference =
      PairedShareDifference({.both = 1, .only_first = 1, .only_second = 7, .neither = 12});
  EXPECT_NEAR(difference.estimate, -0.286, 5e-4);
  EXPECT_NEAR(difference.interval.lower, -0.507, 5e-4);
  EXPECT_NEAR(difference.interval.upper, -0.026, 5e-4);
}

TEST(PairedShareDifference, TurnsRoundWithTheMethods) {
  for (const PairCounts& counts : {PairCounts{.both = 40, .only_first = 6, .only_second = 1, .neither = 3},
                                   PairCounts{.both = 2, .only_first = 20, .only_second = 25, .neither = 3}}) {
    PairCounts turned = counts;
    std::swap(turned.only_first, turned.only_second);
    const ShareDifference one = PairedShareDifference(counts);
    const ShareDifference other = PairedShareDifference(turned);
    EXPECT_EQ(one.estimate, -other.estimate);
    EXPECT_NEAR(one.interval.lower, -other.interval.upper, 1e-15);
    EXPECT_NEAR(one.interval.upper, -other.interval.lower, 1e-15);
  }
}

TEST(PairedShareDifference, IsNotCertainOfDegenerateTables) {
  const ShareDifference all_solved = PairedShareDifference({.both = 50});
  EXPECT_EQ(all_solved.estimate, 0.0);
  EXPECT_NEAR(all_solved.interval.lower, -0.0713, 1e-4);  // Wilson's 1 - 0.9287: the correlation is unknown
  EXPECT_NEAR(all_solved.interval.upper, 0.0713, 1e-4);
  const ShareDifference one_way = PairedShareDifference({.only_first = 3});
  EXPECT_EQ(one_way.estimate, 1.0);
  EXPECT_EQ(one_way.interval.upper, 1.0);
  EXPECT_LT(one_way.interval.lower, 0.3);
  EXPECT_EQ(PairedShareDifference({}).estimate, 0.0);
  EXPECT_EQ(PairedShareDifference({}).interval.lower, -1.0);
  EXPECT_EQ(PairedShareDifference({}).interval.upper, 1.0);
}

TEST(PairedShareDifference, CoversByTheLevel) {
  std::mt19937_64 generator(7);
  constexpr int kSamples = 4000;
  int covered = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    PairCounts counts;
    for (int problem = 0; problem < 50; ++problem) {
      const double u = UniformRandom(generator);
      ++(u < 0.7 ? counts.both : u < 0.85 ? counts.only_first : u < 0.9 ? counts.only_second : counts.neither);
    }
    const Interval interval = PairedShareDifference(counts).interval;
    if (interval.lower <= 0.1 && 0.1 <= interval.upper) ++covered;
  }
  EXPECT_NEAR(static_cast<double>(covered) / kSamples, 0.95, 0.02);
}

TEST(PairedShareDifference, RefusesBadInput) {
  EXPECT_REFUSED(PairedShareDifference({.neither = -1}), "PairedShareDifference: neither: must not be below 0");
  EXPECT_REFUSED(PairedShareDifference({}, 0.0), "level");
}

// Fagerland, Lydersen, Laake 2013, table 1 and text.
TEST(McNemar, HasFagerlandsFigures) {
  EXPECT_EQ(McNemar(1, 7).exact_p, 0.0703125);
  EXPECT_EQ(McNemar(1, 7).mid_p, 0.0390625);
  EXPECT_NEAR(McNemar(6, 16).exact_p, 0.052479, 5e-7);
  EXPECT_NEAR(McNemar(6, 16).mid_p, 0.034690, 5e-7);
}

TEST(McNemar, OfAgrestisApprovalRatings) {
  EXPECT_NEAR(McNemar(150, 86).exact_p, 3.716e-5, 5e-9);
  EXPECT_NEAR(McNemar(150, 86).mid_p, 2.893e-5, 5e-9);
}

TEST(McNemar, OneWayNeedsSixExactlyAndFiveByMidP) {
  EXPECT_EQ(McNemar(4, 0).exact_p, 0.125);
  EXPECT_EQ(McNemar(4, 0).mid_p, 0.0625);
  EXPECT_EQ(McNemar(5, 0).exact_p, 0.0625);
  EXPECT_EQ(McNemar(5, 0).mid_p, 0.03125);
  EXPECT_EQ(McNemar(6, 0).exact_p, 0.03125);
  EXPECT_EQ(McNemar(6, 0).mid_p, 0.015625);
}

TEST(McNemar, EqualCountsAndNone) {
  EXPECT_EQ(McNemar(5, 5).exact_p, 1.0);
  EXPECT_NEAR(McNemar(5, 5).mid_p, 0.876953, 5e-7);
  EXPECT_EQ(McNemar(0, 0).discordant, 0);
  EXPECT_EQ(McNemar(0, 0).exact_p, 1.0);
  EXPECT_EQ(McNemar(0, 0).mid_p, 1.0);
}

TEST(McNemar, TurnsRoundAndKeepsItsLevel) {
  for (int n = 1; n <= 60; ++n) {
    double exact_level = 0.0;
    double mid_level = 0.0;
    for (int b = 0; b <= n; ++b) {
      const McNemarTest test = McNemar(b, n - b);
      EXPECT_EQ(test.exact_p, McNemar(n - b, b).exact_p);
      EXPECT_LE(test.mid_p, test.exact_p);
      if (test.exact_p <= 0.05) exact_level += pdf(boost::math::binomial(n, 0.5), b);
      if (test.mid_p <= 0.05) mid_level += pdf(boost::math::binomial(n, 0.5), b);
    }
    EXPECT_LE(exact_level, 0.05) << n;
    EXPECT_LE(mid_level, 0.08) << n;  // given n; it may exceed 0.05 a little, but not on average over n
  }
}

TEST(McNemar, RefusesNegativeCounts) {
  EXPECT_REFUSED(McNemar(-1, 2), "McNemar: only_first: must not be below 0 (got '-1')");
  EXPECT_REFUSED(McNemar(1, -2), "McNemar: only_second");
}

}  // namespace
}  // namespace legopt::statistics
