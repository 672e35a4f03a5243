// Policy: published examples, every sign enumerated where possible, levels and coverage by simulation from a fixed
// seed, and a defined result if nothing differs.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "legopt/math/random_numbers.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "legopt/statistics/internal/checks.h"
#include "tests/statistics/refusal.h"

namespace legopt::statistics {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const std::vector<double> kDarwin{6, 8, 14, 16, 23, 24, 28, 29, 41, -48, 49, 56, 60, -67, 75};

// Depression scores before and after therapy: Hollander and Wolfe, and the example of R's wilcox.test.
std::vector<double> Depression() {
  const std::vector<double> before{1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30};
  const std::vector<double> after{0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29};
  std::vector<double> differences;
  for (std::size_t i = 0; i < before.size(); ++i) differences.push_back(before[i] - after[i]);
  return differences;
}

TEST(Ranks, AreMeansOfTheirPlaces) {
  const Ranks ranks = MidRanks(std::vector<double>{3.0, 1.0, kInfinity, 3.0, kInfinity, 3.0});
  EXPECT_THAT(ranks.ranks, ElementsAre(3.0, 1.0, 5.5, 3.0, 5.5, 3.0));
  EXPECT_EQ(ranks.tie_sum, 24.0 + 6.0);
  EXPECT_THAT(MidRanks({}).ranks, IsEmpty());
  EXPECT_REFUSED(MidRanks(std::vector<double>{1.0, std::nan("")}), "values[1]: must be a number or +infinity");
}

// Fisher counts 863 of the 2^15 sign patterns whose sum is at least that of Darwin's maize, 314.
TEST(SignFlip, OfDarwinsMaize) {
  std::vector<int> differences;
  for (const double difference : kDarwin) differences.push_back(static_cast<int>(difference));
  const PermutationTest test = SignFlip(differences);
  EXPECT_EQ(test.pairs, 15);
  EXPECT_TRUE(test.exact);
  EXPECT_DOUBLE_EQ(test.p, 2.0 * 863.0 / 32768.0);
}

TEST(SignFlip, AgreesWithEnumerationAndIsSymmetric) {
  std::mt19937 generator(4);
  for (int k = 0; k < 50; ++k) {
    std::vector<int> differences(static_cast<std::size_t>(1 + k % 9)), opposite;
    for (int& d : differences) d = std::uniform_int_distribution(-10, 10)(generator);
    for (const int d : differences) opposite.push_back(-d);
    const int observed = std::abs(std::accumulate(differences.begin(), differences.end(), 0));
    int extreme = 0;
    for (unsigned signs = 0; signs < (1U << differences.size()); ++signs) {
      int sum = 0;
      for (std::size_t i = 0; i < differences.size(); ++i)
        sum += ((signs >> i) & 1U) != 0 ? differences[i] : -differences[i];
      extreme += std::abs(sum) >= observed ? 1 : 0;
    }
    EXPECT_NEAR(SignFlip(differences).p, extreme / std::exp2(differences.size()), 1e-12);
    EXPECT_EQ(SignFlip(differences).p, SignFlip(opposite).p);
  }
}

TEST(SignFlip, ManyPairsAreNormalAndNoneIsNoTest) {
  EXPECT_EQ(SignFlip(std::vector<int>{0, 0}).p, 1.0);
  EXPECT_EQ(SignFlip(std::vector<int>{0, 0}).pairs, 0);
  std::vector<int> many(30'000, 1);
  std::fill(many.begin(), many.begin() + 14'800, -1);
  const PermutationTest test = SignFlip(many);
  EXPECT_FALSE(test.exact);
  EXPECT_NEAR(test.p, 2.0 * 0.5 * std::erfc(400.0 / std::sqrt(30'000.0) / std::sqrt(2.0)), 1e-9);
  EXPECT_REFUSED(SignFlip(std::vector<int>{1 << 30, 1 << 30}), "their sum must not be above 2^30");
}

TEST(SignedRank, OfDepressionScores) {
  const SignedRankTest test = SignedRank(Depression());
  EXPECT_EQ(test.positive_sum, 40.0);
  EXPECT_EQ(test.negative_sum, 5.0);
  EXPECT_EQ(test.greater_p, 0.01953125);
  EXPECT_EQ(test.two_sided_p, 0.0390625);
  EXPECT_TRUE(test.exact);
}

TEST(SignedRank, OfDarwinsMaize) {
  const SignedRankTest test = SignedRank(kDarwin);
  EXPECT_EQ(test.negative_sum, 24.0);
  EXPECT_EQ(test.two_sided_p, 0.041259765625);
  const SignedRankTest normal = SignedRank(kDarwin, {.max_exact_pairs = 0});
  EXPECT_FALSE(normal.exact);
  EXPECT_NEAR(normal.two_sided_p, 0.040888, 5e-7);
}

// C4.5 with and without m on 14 data sets, in thousandths (Demsar 2006, table 2). He splits the ranks of the two
// zeros, 1.5 to either side, so that his sums are 93 and 12.
TEST(SignedRank, OfDemsarsTable) {
  const std::vector<double> thousandths{5, -8, 17, 33, 6, -5, 7, 0, 63, 0, 22, 47, 9, 21};
  const SignedRankTest test = SignedRank(thousandths, {.zeros = ZeroRule::kPratt});
  EXPECT_EQ(test.positive_sum, 93.0 - 1.5);
  EXPECT_EQ(test.negative_sum, 12.0 - 1.5);
  EXPECT_EQ(test.zeros, 2);
  EXPECT_EQ(test.pairs, 12);
  EXPECT_LT(test.two_sided_p, 0.05);
}

// Enumerates all signs.
double EnumeratedGreater(const std::vector<double>& differences, ZeroRule zeros) {
  std::vector<double> magnitudes;
  std::vector<double> signs;
  for (const double d : differences) {
    if (d == 0.0 && zeros == ZeroRule::kDrop) continue;
    magnitudes.push_back(std::abs(d));
    signs.push_back(d);
  }
  const std::vector<double> all = MidRanks(magnitudes).ranks;
  std::vector<double> ranks;
  double observed = 0.0;
  for (std::size_t i = 0; i < signs.size(); ++i) {
    if (signs[i] != 0.0) ranks.push_back(all[i]);
    if (signs[i] > 0.0) observed += all[i];
  }
  int as_large = 0;
  for (unsigned pattern = 0; pattern < 1U << ranks.size(); ++pattern) {
    double sum = 0.0;
    for (std::size_t i = 0; i < ranks.size(); ++i) sum += (pattern >> i & 1U) != 0 ? ranks[i] : 0.0;
    if (sum >= observed) ++as_large;
  }
  return as_large / std::pow(2.0, static_cast<double>(ranks.size()));
}

TEST(SignedRank, IsExactWithTiesAndZeros) {
  std::mt19937_64 generator(3);
  for (int sample = 0; sample < 60; ++sample) {
    std::vector<double> differences(static_cast<std::size_t>(1 + sample % 11));
    for (double& d : differences) d = std::floor(9.0 * UniformRandom(generator)) - 3.0;
    for (const ZeroRule zeros : {ZeroRule::kDrop, ZeroRule::kPratt}) {
      const SignedRankTest test = SignedRank(differences, {.zeros = zeros});
      if (test.pairs == 0) continue;
      EXPECT_EQ(test.greater_p, EnumeratedGreater(differences, zeros));
    }
  }
}

TEST(SignedRank, TurnsRoundAndForgetsTheOrder) {
  std::vector<double> differences = kDarwin;
  const SignedRankTest test = SignedRank(differences);
  std::reverse(differences.begin(), differences.end());
  EXPECT_EQ(SignedRank(differences).greater_p, test.greater_p);
  for (double& d : differences) d = -3.5 * d;
  const SignedRankTest turned = SignedRank(differences);
  EXPECT_EQ(turned.less_p, test.greater_p);
  EXPECT_EQ(turned.greater_p, test.less_p);
  EXPECT_EQ(turned.two_sided_p, test.two_sided_p);
}

TEST(SignedRank, WithoutADifferenceThereIsNoTest) {
  for (const std::vector<double>& differences : {std::vector<double>{}, std::vector<double>(5, 0.0)}) {
    const SignedRankTest test = SignedRank(differences);
    EXPECT_EQ(test.pairs, 0);
    EXPECT_EQ(test.zeros, static_cast<int>(differences.size()));
    EXPECT_EQ(test.two_sided_p, 1.0);
    EXPECT_EQ(test.greater_p, 1.0);
    EXPECT_EQ(test.less_p, 1.0);
  }
}

TEST(SignedRank, OfDifferencesThatAreAllTied) {
  const SignedRankTest test = SignedRank(std::vector<double>(8, 2.0));
  EXPECT_EQ(test.positive_sum, 36.0);
  EXPECT_EQ(test.greater_p, std::pow(0.5, 8));
  EXPECT_EQ(test.less_p, 1.0);
  EXPECT_EQ(SignedRank(std::vector<double>{-1.0}).two_sided_p, 1.0);
}

TEST(SignedRank, NormalAndExactMeetAtTheChange) {
  std::mt19937_64 generator(5);
  NormalRandom normal;
  std::vector<double> differences(200);
  for (double& d : differences) d = 0.1 + normal.Next(generator);
  const SignedRankTest exact = SignedRank(differences);
  const SignedRankTest approximate = SignedRank(differences, {.max_exact_pairs = 199});
  EXPECT_TRUE(exact.exact);
  EXPECT_FALSE(approximate.exact);
  EXPECT_NEAR(exact.two_sided_p, approximate.two_sided_p, 1e-3);
}

TEST(SignedRank, RejectsAsOftenAsItSaysUnderTheNull) {
  std::mt19937_64 generator(11);
  constexpr int kSamples = 4000;
  int rejected = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    std::vector<double> differences(20);
    for (double& d : differences) d = std::floor(14.0 * UniformRandom(generator)) - 6.5;  // symmetric, with many ties
    if (SignedRank(differences).two_sided_p <= 0.05) ++rejected;
  }
  EXPECT_NEAR(static_cast<double>(rejected) / kSamples, 0.047, 0.011);
}

TEST(SignedRank, RefusesBadInput) {
  EXPECT_REFUSED(SignedRank(std::vector<double>{1.0, std::nan("")}), "SignedRank: differences[1]: must be a finite");
  EXPECT_REFUSED(SignedRank(std::vector<double>{kInfinity}), "got 'inf'");
  EXPECT_REFUSED(SignedRank({}, {.max_exact_pairs = -1}), "most_exact_pairs: must not be below 0");
  EXPECT_REFUSED(SignedRank({}, {.max_exact_pairs = 1001}), "most_exact_pairs: must not be above 1000");
}

// Hollander and Wolfe's own interval, of the level 96.1 %, is (0.010, 0.786).
TEST(HodgesLehmann, OfDepressionScores) {
  const Location location = HodgesLehmann(Depression(), 0.96);
  EXPECT_NEAR(location.estimate, 0.46, 1e-12);
  EXPECT_NEAR(location.interval.lower, 0.010, 1e-12);
  EXPECT_NEAR(location.interval.upper, 0.786, 1e-12);
  EXPECT_EQ(location.coverage, 1.0 - 2.0 * 10.0 / 512.0);
}

TEST(HodgesLehmann, EndsAreWhereTheTestTurns) {
  const Location location = HodgesLehmann(kDarwin, 0.9);
  const auto rejects = [](double shift) {
    std::vector<double> shifted;
    for (const double d : kDarwin) shifted.push_back(d - shift);
    return SignedRank(shifted).two_sided_p <= 0.1;
  };
  EXPECT_TRUE(rejects(location.interval.lower - 0.01));
  EXPECT_FALSE(rejects(location.interval.lower + 0.01));
  EXPECT_FALSE(rejects(location.interval.upper - 0.01));
  EXPECT_TRUE(rejects(location.interval.upper + 0.01));
}

TEST(HodgesLehmann, FewDifferencesBoundNothing) {
  EXPECT_TRUE(std::isnan(HodgesLehmann({}).estimate));
  EXPECT_EQ(HodgesLehmann({}).interval.lower, -kInfinity);
  const Location five = HodgesLehmann(std::vector<double>{1, 2, 3, 4, 5});
  EXPECT_EQ(five.estimate, 3.0);
  EXPECT_EQ(five.interval.lower, -kInfinity);
  EXPECT_EQ(five.interval.upper, kInfinity);
  EXPECT_EQ(five.coverage, 1.0);
  const Location six = HodgesLehmann(std::vector<double>{1, 2, 3, 4, 5, 6});
  EXPECT_EQ(six.interval.lower, 1.0);
  EXPECT_EQ(six.interval.upper, 6.0);
  EXPECT_EQ(six.coverage, 0.96875);
}

TEST(HodgesLehmann, OfEqualDifferences) {
  const Location location = HodgesLehmann(std::vector<double>(12, 0.25));
  EXPECT_EQ(location.estimate, 0.25);
  EXPECT_EQ(location.interval.lower, 0.25);
  EXPECT_EQ(location.interval.upper, 0.25);
}

TEST(HodgesLehmann, MovesWithTheDataAndForgetsTheOrder) {
  std::vector<double> moved = kDarwin;
  std::reverse(moved.begin(), moved.end());
  for (double& d : moved) d = 2.0 * d + 64.0;
  EXPECT_DOUBLE_EQ(HodgesLehmann(moved).estimate, 2.0 * HodgesLehmann(kDarwin).estimate + 64.0);
  EXPECT_DOUBLE_EQ(HodgesLehmann(moved).interval.lower, 2.0 * HodgesLehmann(kDarwin).interval.lower + 64.0);
}

double CoverageOf(int count, int samples) {
  std::mt19937_64 generator(17);
  int covered = 0;
  for (int sample = 0; sample < samples; ++sample) {
    std::vector<double> differences(static_cast<std::size_t>(count));
    for (double& d : differences) d = std::tan(3.0 * (UniformRandom(generator) - 0.5));  // long tails around 0
    const Interval interval = HodgesLehmann(differences).interval;
    if (interval.lower <= 0.0 && 0.0 <= interval.upper) ++covered;
  }
  return static_cast<double>(covered) / samples;
}

TEST(HodgesLehmann, CoversByTheLevel) {
  EXPECT_NEAR(CoverageOf(12, 3000), 0.958, 0.012);  // exact: 1 - 2 * 86/4096
  EXPECT_NEAR(CoverageOf(210, 500), 0.95, 0.03);    // normal approximation
}

TEST(HodgesLehmann, RefusesBadInput) {
  EXPECT_REFUSED(HodgesLehmann(std::vector<double>{kInfinity}),
                 "HodgesLehmann: differences[0]: must be a finite number");
  EXPECT_REFUSED(HodgesLehmann({}, 2.0), "level");
  EXPECT_REFUSED(HodgesLehmann(std::vector<double>(kMaxHodgesLehmann + 1)),
                 "must not be more than 10000 (got '10001')");
}

}  // namespace
}  // namespace legopt::statistics
