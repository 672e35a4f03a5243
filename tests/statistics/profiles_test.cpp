// Policy: the toy pool computed by hand, the warning of Gould and Scott as a test, failures that are never reached,
// repetitions weighted as one problem.

#include "legopt/statistics/profiles.h"

#include <cmath>
#include <limits>

#include "legopt/statistics/internal/checks.h"
#include "tests/statistics/refusal.h"
#include "tests/statistics/toy.h"

namespace legopt::statistics {
namespace {

using ::testing::DoubleEq;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<double> SharesOf(const StepCurve& curve, std::initializer_list<double> places) {
  std::vector<double> shares;
  for (const double place : places) shares.push_back(curve.At(place));
  return shares;
}

TEST(Profile, OfTheToy) {
  const PerformanceProfile profile = ProfileOf(ToyRows());
  EXPECT_EQ(profile.problems, 5);
  EXPECT_EQ(profile.unsolved, 0);
  EXPECT_THAT(SharesOf(profile.curves[0], {1, 2, 4, 8}), ElementsAre(0.2, 0.8, 0.8, 0.8));
  EXPECT_THAT(SharesOf(profile.curves[1], {1, 2, 4, 8}), ElementsAre(0.6, 0.8, 0.8, 0.8));
  EXPECT_THAT(SharesOf(profile.curves[2], {1, 2, 4, 8}), ElementsAre(0.2, 0.2, 0.6, 0.6));
}

TEST(Profile, OtherMethodsOfThePoolDecide) {
  std::vector<std::vector<double>> rows;
  for (const std::vector<double>& row : ToyRows()) rows.push_back({row[0], row[2]});
  const PerformanceProfile profile = ProfileOf(rows);
  EXPECT_EQ(profile.curves[0].At(1.0), 0.6);  // 0.2 if compared with B
  EXPECT_EQ(profile.unsolved, 1);
}

TEST(Profile, AProblemThatNobodySolvedIsInTheShares) {
  const PerformanceProfile profile = ProfileOf(std::vector<std::vector<double>>{{1.0, 3.0}, {kInfinity, kInfinity}});
  EXPECT_EQ(profile.unsolved, 1);
  EXPECT_EQ(profile.curves[0].At(1e9), 0.5);
  EXPECT_EQ(profile.curves[1].At(kInfinity), 0.5);
}

TEST(Profile, OfNothingOneMethodAndTies) {
  EXPECT_THAT(ProfileOf({}).curves, IsEmpty());
  const PerformanceProfile alone = ProfileOf(std::vector<std::vector<double>>{{5.0}, {kInfinity}});
  EXPECT_THAT(alone.curves[0].at, ElementsAre(1.0));
  EXPECT_THAT(alone.curves[0].share, ElementsAre(0.5));
  const PerformanceProfile tied = ProfileOf(std::vector<std::vector<double>>(3, {2.0, 2.0}));
  EXPECT_EQ(tied.curves[0].At(1.0), 1.0);
  EXPECT_EQ(tied.curves[1].At(1.0), 1.0);
}

TEST(Profile, DoesNotDependOnTheUnit) {
  std::vector<std::vector<double>> rows = ToyRows();
  for (std::vector<double>& row : rows) {
    for (double& value : row) value *= 1024.0;
  }
  EXPECT_THAT(ProfileOf(rows).curves[2].at, ProfileOf(ToyRows()).curves[2].at);
}

TEST(Distribution, FailuresNeverArrive) {
  const StepCurve curve = Distribution(std::vector<double>{4.0, 1.0, kInfinity, 4.0});
  EXPECT_THAT(curve.at, ElementsAre(1.0, 4.0));
  EXPECT_THAT(curve.share, ElementsAre(0.25, 0.75));
  EXPECT_EQ(curve.At(0.999), 0.0);
  EXPECT_EQ(curve.At(1.0), 0.25);
  EXPECT_EQ(curve.At(kInfinity), 0.75);
  EXPECT_EQ(curve.FirstReaching(0.25), 1.0);
  EXPECT_EQ(curve.FirstReaching(0.5), 4.0);
  EXPECT_EQ(curve.FirstReaching(0.76), kInfinity);
}

TEST(Distribution, OfNothingAndOfFailures) {
  EXPECT_THAT(Distribution({}).at, IsEmpty());
  EXPECT_EQ(Distribution({}).At(3.0), 0.0);
  EXPECT_EQ(Distribution(std::vector<double>(4, kInfinity)).At(kInfinity), 0.0);
  EXPECT_EQ(Distribution(std::vector<double>(4, kInfinity)).FirstReaching(0.1), kInfinity);
}

TEST(Distribution, OfRunsGivesEachProblemOneWeight) {
  const Repetition queued{};
  const std::vector<std::vector<Repetition>> problems{
      {{.end = RunOutcome::kSolved, .value = 1.0}, {.end = RunOutcome::kFailed, .value = 50.0}, queued},
      {{.end = RunOutcome::kSolved, .value = 3.0}},
      {queued},  // not counted
      {}};
  const StepCurve curve = RuntimeDistribution(problems);
  EXPECT_THAT(curve.at, ElementsAre(1.0, 3.0));
  EXPECT_THAT(curve.share, ElementsAre(DoubleEq(0.25), DoubleEq(0.75)));
  EXPECT_THAT(RuntimeDistribution({}).at, IsEmpty());
}

TEST(Distribution, OfSingleRunsIsTheSame) {
  std::vector<std::vector<Repetition>> problems;
  for (const double time : ToyColumn(1)) {
    problems.push_back({std::isfinite(time) ? Repetition{.end = RunOutcome::kSolved, .value = time}
                                            : Repetition{.end = RunOutcome::kFailed, .value = 100.0}});
  }
  EXPECT_EQ(RuntimeDistribution(problems).at, Distribution(ToyColumn(1)).at);
  EXPECT_EQ(RuntimeDistribution(problems).share, Distribution(ToyColumn(1)).share);
}

TEST(Distribution, ThirdsAddUpToNoMoreThanAll) {
  const std::vector<std::vector<Repetition>> problems(7, {{.end = RunOutcome::kSolved, .value = 1},
                                                          {.end = RunOutcome::kSolved, .value = 2},
                                                          {.end = RunOutcome::kSolved, .value = 3}});
  EXPECT_LE(RuntimeDistribution(problems).share.back(), 1.0);
  EXPECT_NEAR(RuntimeDistribution(problems).share.back(), 1.0, 1e-15);
}

TEST(Dominance, OfCurves) {
  const StepCurve a = Distribution(std::vector<double>{1, 2, 3});
  const StepCurve slower = Distribution(std::vector<double>{1, 2, 4});
  const StepCurve failing = Distribution(std::vector<double>{1, 2, kInfinity});
  const StepCurve crossing = Distribution(std::vector<double>{0.5, 2, kInfinity});
  EXPECT_EQ(Compare(a, a), Dominance::kEqual);
  EXPECT_EQ(Compare(a, slower), Dominance::kFirst);
  EXPECT_EQ(Compare(slower, a), Dominance::kSecond);
  EXPECT_EQ(Compare(slower, failing), Dominance::kFirst);
  EXPECT_EQ(Compare(a, crossing), Dominance::kNone);
  EXPECT_EQ(Compare({}, a), Dominance::kSecond);
  EXPECT_EQ(Compare({}, {}), Dominance::kEqual);
}

TEST(Profiles, RefuseBadInput) {
  EXPECT_REFUSED(ProfileOf(std::vector<std::vector<double>>{{1.0, 0.0}}),
                 "ProfileOf: rows[0][1]: must be a number or +inf");
  EXPECT_REFUSED(ProfileOf(std::vector<std::vector<double>>{{1.0}, {}}), "ProfileOf: rows[1]: must be as long");
  EXPECT_REFUSED(Distribution(std::vector<double>{std::nan("")}), "Distribution: values[0]");
  EXPECT_REFUSED(StepCurve{}.At(std::nan("")), "At: x: must be a number");
  EXPECT_REFUSED(StepCurve{}.FirstReaching(0.0), "FirstReaching: reached: must lie in (0, 1]");
}

TEST(RuntimeCurves, CrossWhereTheFirstLeaderIsOvertaken) {
  const StepCurve quick = Distribution(std::vector<double>{1, 2, kInfinity, kInfinity});
  const StepCurve thorough = Distribution(std::vector<double>{2, 3, 5, 7});
  EXPECT_EQ(FirstCrossing(quick, thorough), 5.0);
  EXPECT_EQ(FirstCrossing(thorough, quick), 5.0);
  EXPECT_EQ(FirstCrossing(quick, quick), kInfinity);
  EXPECT_EQ(FirstCrossing(thorough, Distribution(std::vector<double>{3, 4, 6, kInfinity})), kInfinity);
}

}  // namespace
}  // namespace legopt::statistics
