// Policy: the book's example, levels computed by hand, the same random numbers everywhere, coverage by simulation from
// a fixed seed, and a defined result for too few, constant and infinite values.

#include "legopt/statistics/bootstrap.h"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "legopt/math/random_numbers.h"
#include "legopt/statistics/internal/checks.h"
#include "legopt/statistics/problem_scores.h"
#include "tests/statistics/refusal.h"

namespace legopt::statistics {
namespace {

ProblemStatistic MeanOf(const std::vector<double>& values) {
  return [&values](std::span<const int> problems) {
    double sum = 0.0;
    for (const int problem : problems) sum += values[static_cast<std::size_t>(problem)];
    return sum / static_cast<double>(problems.size());
  };
}

ProblemStatistic VarianceOf(const std::vector<double>& values) {
  return [&values](std::span<const int> problems) {
    const double mean = MeanOf(values)(problems);
    double squares = 0.0;
    for (const int problem : problems) squares += std::pow(values[static_cast<std::size_t>(problem)] - mean, 2.0);
    return squares / static_cast<double>(problems.size());
  };
}

// Spatial perception of 26 children (Efron, Tibshirani 1993, table 14.1).
const std::vector<double> kSpatial{48, 36, 20, 29, 42, 42, 20, 42, 22, 41, 45, 14, 6,
                                   0,  33, 28, 34, 4,  32, 24, 47, 41, 24, 26, 30, 41};

// 90 %: the book prints BCa (115.8, 259.6) and percentiles (100.8, 233.9) from 2,000 resamples, whose own error is
// about 3.
TEST(Bootstrap, OfTheBooksExample) {
  constexpr double kOfTwoThousandDraws = 4.0;
  BootstrapOptions options{.resamples = 200'000, .level = 0.9};
  const BootstrapEstimate bca = Bootstrap(26, VarianceOf(kSpatial), options);
  EXPECT_NEAR(bca.value, 171.534, 5e-4);
  EXPECT_NEAR(bca.acceleration, 0.0612, 5e-5);
  EXPECT_NEAR(bca.bias, 0.17146, 0.01);
  EXPECT_NEAR(bca.interval.lower, 115.8, kOfTwoThousandDraws);
  EXPECT_NEAR(bca.interval.upper, 259.6, kOfTwoThousandDraws);
  options.kind = BootstrapKind::kPercentile;
  const BootstrapEstimate percentile = Bootstrap(26, VarianceOf(kSpatial), options);
  EXPECT_NEAR(percentile.interval.lower, 100.8, kOfTwoThousandDraws);
  EXPECT_NEAR(percentile.interval.upper, 233.9, kOfTwoThousandDraws);
  EXPECT_EQ(percentile.bias, 0.0);
  // SciPy, mean of six times 200,000 resamples.
  EXPECT_NEAR(bca.interval.lower, 115.7, 1.0);
  EXPECT_NEAR(bca.interval.upper, 261.2, 1.0);
  EXPECT_NEAR(percentile.interval.lower, 97.9, 0.5);
  EXPECT_NEAR(percentile.interval.upper, 235.6, 0.5);
}

TEST(Bootstrap, LevelsOfTheBooksExample) {
  const Interval levels = BcaLevels(0.17146, 0.0612, 0.9);
  EXPECT_NEAR(levels.lower, 0.1190, 5e-5);
  EXPECT_NEAR(levels.upper, 0.9866, 5e-5);
  EXPECT_NEAR(BcaLevels(0.0, 0.0, 0.95).lower, 0.025, 1e-15);
  EXPECT_NEAR(BcaLevels(0.0, 0.0, 0.95).upper, 0.975, 1e-15);
  // Beyond the pole of the formula the level is 0 or 1, depending on the side.
  EXPECT_EQ(BcaLevels(4.0, 0.3, 0.95).upper, 1.0);
  EXPECT_EQ(BcaLevels(-4.0, -0.3, 0.95).lower, 0.0);
}

TEST(Bootstrap, LevelsTurnRound) {
  for (const double bias : {-0.5, 0.0, 0.2}) {
    for (const double acceleration : {-0.1, 0.0, 0.05}) {
      const Interval levels = BcaLevels(bias, acceleration, 0.9);
      const Interval turned = BcaLevels(-bias, -acceleration, 0.9);
      EXPECT_NEAR(levels.lower, 1.0 - turned.upper, 1e-14);
      EXPECT_LT(levels.lower, levels.upper);
    }
  }
}

TEST(Bootstrap, DrawsAreTheSameEverywhere) {
  std::vector<int> seen;
  const ProblemStatistic watch = [&](std::span<const int> problems) {
    seen.insert(seen.end(), problems.begin(), problems.end());
    return static_cast<double>(problems[0]);
  };
  Bootstrap(5, watch, {.resamples = 2, .seed = 42, .kind = BootstrapKind::kPercentile});
  EXPECT_THAT(seen, ::testing::ElementsAre(0, 1, 2, 3, 4, 0, 3, 3, 3, 4, 0, 1, 1, 1, 2));
}

TEST(Bootstrap, SameSeedSameBits) {
  const BootstrapOptions options{.resamples = 500, .seed = 9};
  const BootstrapEstimate one = Bootstrap(26, MeanOf(kSpatial), options);
  const BootstrapEstimate again = Bootstrap(26, MeanOf(kSpatial), options);
  EXPECT_EQ(one.interval.lower, again.interval.lower);
  EXPECT_EQ(one.interval.upper, again.interval.upper);
  const BootstrapEstimate other = Bootstrap(26, MeanOf(kSpatial), {.resamples = 500, .seed = 10});
  EXPECT_NE(one.interval.lower, other.interval.lower);
}

TEST(Bootstrap, BcaFollowsMonotoneScales) {
  const BootstrapOptions options{.resamples = 2001, .level = 0.9};
  const BootstrapEstimate plain = Bootstrap(26, VarianceOf(kSpatial), options);
  const ProblemStatistic scaled = [](std::span<const int> problems) {
    return 4.0 * VarianceOf(kSpatial)(problems) - 64.0;
  };
  const BootstrapEstimate moved = Bootstrap(26, scaled, options);
  EXPECT_NEAR(moved.interval.lower, 4.0 * plain.interval.lower - 64.0, 1e-9);
  EXPECT_NEAR(moved.interval.upper, 4.0 * plain.interval.upper - 64.0, 1e-9);
}

TEST(Bootstrap, PairsAreDrawnTogether) {
  const std::vector<double> slow{10, 200, 35, 4000, 7, 90};
  const ProblemStatistic ratio = [&](std::span<const int> problems) {
    std::vector<double> ratios;
    for (const int problem : problems) {
      const double time = slow[static_cast<std::size_t>(problem)];
      ratios.push_back(0.5 * time / time);
    }
    return GeometricMean(ratios);
  };
  const BootstrapEstimate estimate = Bootstrap(6, ratio, {.resamples = 200});
  EXPECT_EQ(estimate.value, 0.5);  // differences between the problems do not matter
  EXPECT_NEAR(estimate.interval.lower, 0.5, 1e-12);
  EXPECT_NEAR(estimate.interval.upper, 0.5, 1e-12);
}

TEST(Bootstrap, TooFewProblemsBoundNothing) {
  const std::vector<double> values{3.0};
  const BootstrapEstimate none = Bootstrap(0, MeanOf(values));
  EXPECT_TRUE(std::isnan(none.value));
  EXPECT_EQ(none.interval.lower, -kInfinity);
  const BootstrapEstimate one = Bootstrap(1, MeanOf(values));
  EXPECT_EQ(one.value, 3.0);
  EXPECT_EQ(one.interval.lower, -kInfinity);
  EXPECT_EQ(one.interval.upper, kInfinity);
}

TEST(Bootstrap, ConstantValuesAreOnePoint) {
  const std::vector<double> values(10, 2.0);
  const BootstrapEstimate estimate = Bootstrap(10, MeanOf(values), {.resamples = 100});
  EXPECT_EQ(estimate.interval.lower, 2.0);
  EXPECT_EQ(estimate.interval.upper, 2.0);
  EXPECT_EQ(estimate.bias, 0.0);
  EXPECT_EQ(estimate.acceleration, 0.0);
  EXPECT_EQ(estimate.standard_error, 0.0);
}

TEST(Bootstrap, NothingSolvedInSomeResamplesHasNoUpperEnd) {
  const std::vector<double> spent(6, 10.0);
  const std::vector<double> shares{1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  const ProblemStatistic ert = [&](std::span<const int> problems) {
    std::vector<double> of_drawn;
    std::vector<double> shares_of_drawn;
    for (const int problem : problems) {
      of_drawn.push_back(spent[static_cast<std::size_t>(problem)]);
      shares_of_drawn.push_back(shares[static_cast<std::size_t>(problem)]);
    }
    return ExpectedRunningTime(of_drawn, shares_of_drawn).time_ms;
  };
  const BootstrapEstimate estimate = Bootstrap(6, ert, {.resamples = 2000});
  EXPECT_EQ(estimate.value, 60.0);
  EXPECT_GE(estimate.interval.lower, 10.0);
  EXPECT_LE(estimate.interval.lower, 60.0);
  EXPECT_EQ(estimate.interval.upper, kInfinity);
  EXPECT_EQ(estimate.acceleration, 0.0);  // omitting the solved problem gives infinity
  EXPECT_TRUE(std::isnan(estimate.standard_error));
  const ProblemStatistic negative = [&](std::span<const int> problems) { return -ert(problems); };
  const BootstrapEstimate turned = Bootstrap(6, negative, {.resamples = 2000});
  EXPECT_EQ(turned.interval.lower, -kInfinity);
  EXPECT_NEAR(turned.interval.upper, -estimate.interval.lower, 1e-12);
}

TEST(Bootstrap, AllFailedIsInfiniteOnBothSides) {
  const std::vector<double> values(5, kInfinity);
  const BootstrapEstimate estimate = Bootstrap(5, MeanOf(values), {.resamples = 100});
  EXPECT_EQ(estimate.value, kInfinity);
  EXPECT_EQ(estimate.interval.lower, kInfinity);
  EXPECT_EQ(estimate.interval.upper, kInfinity);
}

// Lognormal ratios of times of 30 problems: the interval of their geometric mean.
TEST(Bootstrap, CoversByTheLevel) {
  std::mt19937_64 generator(23);
  NormalRandom normal;
  constexpr int kSamples = 600;
  int covered = 0;
  for (int sample = 0; sample < kSamples; ++sample) {
    std::vector<double> logarithms(30);
    for (double& value : logarithms) value = 0.2 + 0.8 * normal.Next(generator);
    const BootstrapEstimate estimate =
        Bootstrap(30, MeanOf(logarithms), {.resamples = 400, .level = 0.9, .seed = static_cast<std::uint64_t>(sample)});
    if (estimate.interval.lower <= 0.2 && 0.2 <= estimate.interval.upper) ++covered;
  }
  EXPECT_NEAR(static_cast<double>(covered) / kSamples, 0.885, 0.03);
}

TEST(Bootstrap, RefusesBadInput) {
  const std::vector<double> values{1.0, 2.0};
  EXPECT_REFUSED(Bootstrap(-1, MeanOf(values)), "Bootstrap: problems: must not be below 0");
  EXPECT_REFUSED(Bootstrap(2, MeanOf(values), {.resamples = 0}), "resamples: must not be below 1");
  EXPECT_REFUSED(Bootstrap(2, MeanOf(values), {.resamples = 1'000'001}), "resamples: must not be above 1000000");
  EXPECT_REFUSED(Bootstrap(2, MeanOf(values), {.level = 1.0}), "level");
  EXPECT_REFUSED(Bootstrap(2, [](std::span<const int>) { return std::nan(""); }), "statistic: must not be NaN");
  EXPECT_REFUSED(BcaLevels(kInfinity, 0.0, 0.9), "BcaLevels: bias[0]");
}

}  // namespace
}  // namespace legopt::statistics
