// Policy: the toy pool, whose worst method looks best if failures cost nothing; limits of each mean; defined results
// for no problems and for none solved.

#include <algorithm>
#include <cmath>
#include <limits>

#include "legopt/statistics/internal/checks.h"
#include "legopt/statistics/problem_scores.h"
#include "tests/statistics/refusal.h"
#include "tests/statistics/toy.h"

namespace legopt::statistics {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
constexpr double kLimit = 100.0;

std::vector<double> Charged(std::vector<double> times) {
  std::replace(times.begin(), times.end(), kInfinity, kLimit);
  return times;
}

std::vector<double> SolvedOnly(std::vector<double> times) {
  std::erase(times, kInfinity);
  return times;
}

TEST(ChargedTimes, FailingDoesNotPay) {
  double solved_only[3];
  for (std::size_t method = 0; method < 3; ++method) {
    const std::vector<double> solved = SolvedOnly(ToyColumn(method));
    solved_only[method] = PenalisedAverage(solved, kLimit, 1.0);
  }
  EXPECT_THAT(solved_only, ElementsAre(3.75, 5.75, ::testing::DoubleNear(10.0 / 3.0, 1e-12)));  // C, which fails most
  EXPECT_DOUBLE_EQ(PenalisedAverage(ToyColumn(0), kLimit, 10.0), 203.0);
  EXPECT_DOUBLE_EQ(PenalisedAverage(ToyColumn(1), kLimit, 10.0), 204.6);
  EXPECT_DOUBLE_EQ(PenalisedAverage(ToyColumn(2), kLimit, 10.0), 402.0);
  EXPECT_DOUBLE_EQ(PenalisedAverage(ToyColumn(0), kLimit, 2.0), 43.0);
  EXPECT_DOUBLE_EQ(PenalisedAverage(ToyColumn(1), kLimit, 2.0), 44.6);
  EXPECT_DOUBLE_EQ(PenalisedAverage(ToyColumn(2), kLimit, 2.0), 82.0);
}

TEST(ChargedTimes, PenalisedAverageAtItsEnds) {
  EXPECT_TRUE(std::isnan(PenalisedAverage({}, kLimit, 10.0)));
  EXPECT_EQ(PenalisedAverage(std::vector<double>(3, kInfinity), kLimit, 10.0), 1000.0);
  EXPECT_EQ(PenalisedAverage(std::vector<double>{150.0}, kLimit, 10.0), 150.0);  // the judge determines what is
                                                                                 // solved, not the time
}

TEST(ChargedTimes, ExpectedRunningTimeOfTheToy) {
  const double expected[] = {28.75, 30.75, 70.0};
  for (std::size_t method = 0; method < 3; ++method) {
    const std::vector<double> times = ToyColumn(method);
    std::vector<double> shares;
    for (const double time : times) shares.push_back(std::isfinite(time) ? 1.0 : 0.0);
    EXPECT_DOUBLE_EQ(ExpectedRunningTime(Charged(times), shares).time_ms, expected[method]);
  }
}

TEST(ChargedTimes, ExpectedRunningTimeAtItsEnds) {
  const ExpectedTime never = ExpectedRunningTime(std::vector<double>{5.0, 7.0}, std::vector<double>{0.0, 0.0});
  EXPECT_EQ(never.time_ms, kInfinity);
  EXPECT_EQ(never.spent_ms, 12.0);
  EXPECT_EQ(never.successes, 0.0);
  EXPECT_TRUE(std::isnan(ExpectedRunningTime({}, {}).time_ms));
  const std::vector<double> spent{3.0, 5.0};
  EXPECT_EQ(ExpectedRunningTime(spent, std::vector<double>{1.0, 1.0}).time_ms, 4.0);  // all solved: the mean
  EXPECT_EQ(ExpectedRunningTime(spent, std::vector<double>{0.5, 0.5}).time_ms, 8.0);
}

TEST(ChargedTimes, ShiftedGeometricMeanOfTheToy) {
  const double shift_1[] = {6.711467, 7.757463, 14.022451};
  const double shift_10[] = {10.543452, 12.111266, 20.963107};
  for (std::size_t method = 0; method < 3; ++method) {
    EXPECT_NEAR(ShiftedGeometricMean(Charged(ToyColumn(method)), 1.0), shift_1[method], 5e-7);
    EXPECT_NEAR(ShiftedGeometricMean(Charged(ToyColumn(method)), 10.0), shift_10[method], 5e-7);
  }
}

TEST(ChargedTimes, ShiftOfSecondsHidesMilliseconds) {
  const std::vector<double> fast{0.5, 1.0, 2.0};
  const std::vector<double> slow{5.0, 10.0, 20.0};
  EXPECT_GT(ShiftedGeometricMean(slow, 1.0) / ShiftedGeometricMean(fast, 1.0), 8.0);
  // The same times in seconds with a floor of one second: all equal.
  EXPECT_EQ(ShiftedGeometricMean(std::vector<double>{5e-4, 1e-3, 2e-3}, 0.0),
            ShiftedGeometricMean(std::vector<double>{5e-3, 1e-2, 2e-2}, 0.0));
}

TEST(ChargedTimes, ShiftedGeometricMeanAtItsEnds) {
  EXPECT_TRUE(std::isnan(ShiftedGeometricMean({}, 1.0)));
  EXPECT_EQ(ShiftedGeometricMean(std::vector<double>{1.0, kInfinity}, 1.0), kInfinity);
  EXPECT_EQ(ShiftedGeometricMean(std::vector<double>{0.0, 0.0}, 1.0), 0.0);
  EXPECT_NEAR(ShiftedGeometricMean(std::vector<double>{7.0, 7.0, 7.0}, 10.0), 7.0, 1e-13);
}

TEST(ChargedTimes, GeometricMeanTurnsRound) {
  const std::vector<double> ratios{0.5, 4.0, 1.0, 0.25};
  std::vector<double> turned;
  for (const double ratio : ratios) turned.push_back(1.0 / ratio);
  EXPECT_NEAR(GeometricMean(ratios) * GeometricMean(turned), 1.0, 1e-15);
  EXPECT_TRUE(std::isnan(GeometricMean({})));
}

TEST(ChargedTimes, QuantilesReachIntoTheFailures) {
  const std::vector<double> times{3.0, kInfinity, 1.0, 2.0, kInfinity};
  EXPECT_THAT(Quantiles(times, std::vector<double>{0.0, 0.25, 0.375, 0.5, 0.51, 1.0}),
              ElementsAre(1.0, 2.0, 2.5, 3.0, kInfinity, kInfinity));
  EXPECT_THAT(Quantiles(std::vector<double>(2, kInfinity), std::vector<double>{0.0, 0.3}),
              ElementsAre(kInfinity, kInfinity));
  EXPECT_THAT(Quantiles(std::vector<double>{4.0}, std::vector<double>{0.1, 0.9}), ElementsAre(4.0, 4.0));
  EXPECT_THAT(Quantiles({}, std::vector<double>{0.5}), ElementsAre(::testing::IsNan()));
  EXPECT_THAT(Quantiles(times, {}), IsEmpty());
}

TEST(ChargedTimes, RefuseBadInput) {
  const std::vector<double> one{1.0};
  const std::vector<double> negative{-1.0};
  const std::vector<double> nan{std::nan("")};
  EXPECT_REFUSED(PenalisedAverage(negative, 1.0, 2.0),
                 "PenalisedAverage: times_ms[0]: must be a number or +infinity, not");
  EXPECT_REFUSED(PenalisedAverage(nan, 1.0, 2.0), "got 'nan'");
  EXPECT_REFUSED(PenalisedAverage(one, 0.0, 2.0), "limit_ms[0]: must be a finite number, above 0 (got '0')");
  EXPECT_REFUSED(PenalisedAverage(one, 1.0, 0.5), "factor[0]: must be a finite number, not below 1");
  EXPECT_REFUSED(ExpectedRunningTime(one, {}), "ExpectedRunningTime: spent_ms: must be as long");
  EXPECT_REFUSED(ExpectedRunningTime(one, std::vector<double>{1.5}), "shares: must not be above 1");
  EXPECT_REFUSED(ExpectedRunningTime(std::vector<double>{kInfinity}, one), "spent_ms[0]: must be a finite number");
  EXPECT_REFUSED(ShiftedGeometricMean(negative, 1.0), "ShiftedGeometricMean: times_ms[0]");
  EXPECT_REFUSED(ShiftedGeometricMean(one, -1.0), "shift_ms[0]");
  EXPECT_REFUSED(GeometricMean(std::vector<double>{1.0, 0.0}),
                 "GeometricMean: ratios[1]: must be a finite number, above 0");
  EXPECT_REFUSED(Quantiles(nan, one), "Quantiles: values[0]");
  EXPECT_REFUSED(Quantiles(one, std::vector<double>{1.01}), "shares: must not be above 1");
  EXPECT_REFUSED(Quantiles(std::vector<double>{-kInfinity}, one), "got '-inf'");
}

}  // namespace
}  // namespace legopt::statistics
