// Policy: violations between the waypoints of a continuous motion are named, on a robot whose kinematics can be
// computed by hand. An accepted motion stays accepted at every finer resolution.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "legopt/judge/judge.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::kBaseX;
using test::kBaseY;
using test::kLeftShoulder;
using test::kRightHip;
using test::kRightShoulder;
using ::testing::AllOf;
using ::testing::HasSubstr;

class PathTest : public testing::Test {
 protected:
  using Points = std::vector<std::pair<double, Eigen::VectorXd>>;

  Evaluation Judged(const ProblemDefinition& problem, const Points& path, Task task = Task::kContinuous) {
    std::vector<Eigen::VectorXd> points;
    for (const auto& [time, x] : path) {
      points.emplace_back(x.size() + 1);
      points.back() << x, time;
    }
    return judge_.Evaluate(task, problem, points);
  }
  /// Judges a path that differs from `up_` only between waypoints 0 and 1.
  Evaluation By(const Eigen::VectorXd& halfway, Task task = Task::kContinuous) {
    return Judged(standing_twice_, {{0, up_}, {0.5, halfway}, {1, up_}, {2, up_}, {3, up_}}, task);
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  Judge judge_{dataset_};
  Stance stance_ = dataset_->problem(Task::kPosture, 0).stances[0];
  ProblemDefinition standing_twice_{.id = 1, .stances = {stance_, stance_}};
  Eigen::VectorXd up_ = test::StandingUpright();
};

void ExpectPathFailure(const Evaluation& evaluation, Verdict verdict, int waypoint) {
  EXPECT_EQ(ToString(evaluation.literal), ToString(verdict)) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, evaluation.literal);
  EXPECT_EQ(evaluation.solid, evaluation.literal);
  EXPECT_EQ(evaluation.failed_waypoint, waypoint);
  EXPECT_TRUE(std::isnan(evaluation.cost));
}

TEST_F(PathTest, ThatStandsStillSucceedsAndCostsNothing) {
  const Evaluation evaluation = By(up_, Task::kBalanced);
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.cost, 0);
  EXPECT_EQ(evaluation.num_waypoints, 4);
  EXPECT_EQ(evaluation.interpolation.free_share, 1);
}

TEST_F(PathTest, CostsTheSameHoweverAStraightWayIsCutAndWhatTheMotionDoes) {
  Eigen::VectorXd end = up_;
  end[kRightShoulder] = 0.8;
  const auto at = [&](double share) {
    Eigen::VectorXd x = up_;
    x[kRightShoulder] = share * 0.8;
    return x;
  };
  const double whole = Judged(standing_twice_, {{0, up_}, {1, end}, {2, end}, {3, end}}).cost;
  EXPECT_NEAR(whole, 0.8 * 0.8 / 4, 1e-15);
  const std::vector<Eigen::VectorXd> waypoints = {up_, end, end, end};
  EXPECT_NEAR(judge_.Evaluate(Task::kMotion, standing_twice_, waypoints).cost, whole, 1e-15);
  const Points cut = {{0, up_}, {0.25, at(0.25)}, {0.875, at(0.875)}, {1, end}, {2, end}, {3, end}};
  EXPECT_NEAR(Judged(standing_twice_, cut).cost, whole, 1e-15);
  const Points hurried = {{0, up_}, {0.25, at(0.75)}, {1, end}, {2, end}, {3, end}};
  EXPECT_GT(Judged(standing_twice_, hurried).cost, whole);
}

TEST_F(PathTest, PlantedFeetStayWithinTwiceTheToleranceOfWaypoints) {
  Eigen::VectorXd x = up_;
  x[kBaseY] = 0.0019;
  Evaluation evaluation = By(x);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 0.0019, 1e-12);
  x[kBaseY] = 0.0021;
  evaluation = By(x);
  ExpectPathFailure(evaluation, Verdict::kFootPose, 0);
  EXPECT_THAT(evaluation.detail,
              AllOf(HasSubstr("waypoint 0: on the segment to the next waypoint, at time 0.5: planted l_foot"),
                    HasSubstr("off by 2.1 mm (tolerance 2 mm)")));
  EXPECT_NEAR(evaluation.interpolation.free_share, 2.0 / 3.0, 1e-12);
}

// Joints and base move along straight lines, so feet on a turning leg do not stay.
TEST_F(PathTest, PlantedFeetDriftWhenJointsAreInterpolated) {
  constexpr double kLean = 0.2;
  const Eigen::VectorXd end = test::Leaning(kLean);
  const Points straight = {{0, up_}, {1, end}, {2, end}, {3, end}};
  const Evaluation drifting = Judged(standing_twice_, straight);
  ExpectPathFailure(drifting, Verdict::kFootPose, 0);
  const double sag_m = 0.5 * (std::cos(kLean / 2) - (1 + std::cos(kLean)) / 2);  // halfway, legs of 0.5 m
  EXPECT_NEAR(drifting.Largest(Verdict::kFootPose, Rule::kLiteral), sag_m, 1e-4);
  Points cut;
  for (int k = 0; k <= 4; ++k) cut.emplace_back(k / 4.0, test::Leaning(kLean * k / 4));
  cut.insert(cut.end(), straight.end() - 2, straight.end());
  const Evaluation evaluation = Judged(standing_twice_, cut);
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), sag_m / 16, 1e-5)
      << "by the square of the pieces' length";
}

TEST_F(PathTest, AFootThatStepsIsFreeOnItsWayOnly) {
  const auto swung = [this](double angle) {
    Eigen::VectorXd x = up_;
    x[kRightHip] = -angle;
    x[test::kRightAnkle] = angle;
    return x;
  };
  Kinematics kinematics(dataset_->robot());
  const auto right_foot = [&](const Eigen::VectorXd& x) {
    kinematics.Update(x);
    return Eigen::Vector3d(kinematics.link_pose(dataset_->contact("r_foot").link_index).translation());
  };
  const Eigen::VectorXd stepped = swung(0.1);
  ProblemDefinition step = standing_twice_;
  for (ContactTarget& target : step.stances[1].contacts) {
    if (target.contact == "r_foot") target.position += right_foot(stepped) - right_foot(up_);
  }
  const Points on_its_way = {{0, up_}, {1, up_}, {1.5, swung(0.4)}, {2, stepped}, {3, stepped}};
  const Evaluation evaluation = Judged(step, on_its_way);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  const Points before = {{0, up_}, {0.5, swung(0.4)}, {1, up_}, {2, stepped}, {3, stepped}};
  ExpectPathFailure(Judged(step, before), Verdict::kFootPose, 0);
  const Points after = {{0, up_}, {1, up_}, {2, stepped}, {2.5, swung(0.4)}, {3, stepped}};
  ExpectPathFailure(Judged(step, after), Verdict::kFootPose, 2);
}

TEST_F(PathTest, ArmInTheColumnOnTheWay) {
  Eigen::VectorXd x = up_;
  x[kLeftShoulder] = 1.2;
  const Evaluation evaluation = By(x);
  ExpectPathFailure(evaluation, Verdict::kEnvironmentCollision, 0);
  EXPECT_THAT(evaluation.detail, AllOf(HasSubstr("on the segment to the next waypoint, at time 0."),
                                       HasSubstr("l_arm is "), HasSubstr("deep in 'column' of the scene")));
  EXPECT_GT(evaluation.interpolation.environment_depth_m, 1e-3);
}

TEST_F(PathTest, ArmInTheLegOnTheWay) {
  Eigen::VectorXd x = up_;
  x[kLeftShoulder] = -0.35;
  const Evaluation evaluation = By(x);
  ExpectPathFailure(evaluation, Verdict::kSelfCollision, 0);
  EXPECT_THAT(evaluation.detail, HasSubstr("l_leg and l_arm overlap by"));
}

// A quick motion through the column, which is 0.2 m thick, in a segment whose end points are free.
TEST_F(PathTest, NothingIsTooQuickToBeSeen) {
  const ProblemDefinition flying{.id = 1, .stances = {stance_, stance_}};
  Eigen::VectorXd beyond = up_;
  beyond[kBaseY] = 1.2;
  const Evaluation evaluation = By(beyond);
  EXPECT_EQ(evaluation.literal, Verdict::kFootPose) << evaluation.detail;
  EXPECT_GT(evaluation.interpolation.environment_depth_m, 0.05);
}

TEST_F(PathTest, APieceOfMetresWithoutEndIsNotSampled) {
  Eigen::VectorXd far = up_;
  far[kBaseX] = -50;
  Evaluation evaluation = By(far);
  ExpectPathFailure(evaluation, Verdict::kWrongSize, 0);
  EXPECT_THAT(evaluation.detail, HasSubstr("a piece of 50"));
  Eigen::VectorXd turned = up_;
  turned[test::kLidar] = 1e3;
  evaluation = By(turned);
  ExpectPathFailure(evaluation, Verdict::kWrongSize, 0);
  EXPECT_THAT(evaluation.detail, HasSubstr("1000 rad (at most"));
}

TEST_F(PathTest, BalanceIsAskedForByItsTaskOnly) {
  // Halfway the trunk leans so far that its centre of mass leaves the support of the feet, which stay in place.
  Points path;
  for (int k = 0; k <= 16; ++k) path.emplace_back(k / 16.0, test::Leaning(0.6 * std::sin(M_PI * k / 16)));
  path.emplace_back(2, up_);
  path.emplace_back(3, up_);
  path[16].second = up_;
  EXPECT_NE(Judged(standing_twice_, path).literal, Verdict::kCom);
  const Evaluation evaluation = Judged(standing_twice_, path, Task::kBalanced);
  EXPECT_EQ(evaluation.literal, Verdict::kCom) << evaluation.detail;
  EXPECT_THAT(evaluation.detail,
              AllOf(HasSubstr("at time 0."), HasSubstr("outside the support polygon (tolerance 2 mm)")));
  EXPECT_GT(evaluation.Largest(Verdict::kCom, Rule::kLiteral), 0.01);
}

TEST_F(PathTest, NoBalanceWithoutPlantedFoot) {
  ProblemDefinition jump{.id = 1, .stances = {stance_, stance_}};
  for (ContactTarget& target : jump.stances[1].contacts) target.position.x() += 0.01;
  Eigen::VectorXd there = up_;
  there[kBaseX] += 0.01;
  const Points path = {{0, up_}, {1, up_}, {2, there}, {3, there}};
  EXPECT_EQ(Judged(jump, path).literal, Verdict::kSuccess);
  ExpectPathFailure(Judged(jump, path, Task::kBalanced), Verdict::kCom, 1);
}

TEST_F(PathTest, TimedMotionsCostTheirDurationPerStance) {
  EXPECT_EQ(By(up_, Task::kTimed).cost, 0.0);  // at rest
  Eigen::VectorXd there = up_;
  there[kRightShoulder] = 0.2;
  const Points wave = {{0, up_}, {0.5, there}, {1, up_}, {2, up_}, {3, up_}};
  const Evaluation evaluation = Judged(standing_twice_, wave, Task::kTimed);
  ASSERT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
  ASSERT_TRUE(evaluation.timing);
  EXPECT_GT(evaluation.cost, 0.0);
  EXPECT_EQ(evaluation.cost, evaluation.timing->shortest_s / 2);
  EXPECT_LE(evaluation.timing->shortest_s, evaluation.timing->greedy_s);
  EXPECT_FALSE(Judged(standing_twice_, wave, Task::kBalanced).timing);
}

TEST_F(PathTest, TimedMotionsAreJudgedOnTheCurve) {
  // All points keep the limit of 2 rad, and straight pieces do as well, but the curve through them does not.
  const auto at = [&](double angle) {
    Eigen::VectorXd x = up_;
    x[kRightShoulder] = angle;
    return x;
  };
  const Points path = {{0, at(0.0)}, {0.25, at(1.99)}, {0.5, at(1.99)}, {0.75, at(1.0)},
                       {1, at(0.0)}, {2, at(0.0)},     {3, at(0.0)}};
  EXPECT_EQ(Judged(standing_twice_, path, Task::kBalanced).literal, Verdict::kSuccess);
  const Evaluation evaluation = Judged(standing_twice_, path, Task::kTimed);
  EXPECT_EQ(evaluation.literal, Verdict::kJointLimit) << evaluation.detail;
  EXPECT_THAT(evaluation.detail, HasSubstr("beyond its limit"));
  EXPECT_EQ(evaluation.failed_waypoint, 0);
  EXPECT_FALSE(evaluation.timing);
}

TEST_F(PathTest, TimedMotionsBalanceOnTheirPlantedFeet) {
  ProblemDefinition jump{.id = 1, .stances = {stance_, stance_}};
  for (ContactTarget& target : jump.stances[1].contacts) target.position.x() += 0.01;
  Eigen::VectorXd there = up_;
  there[kBaseX] += 0.01;
  ExpectPathFailure(Judged(jump, {{0, up_}, {1, up_}, {2, there}, {3, there}}, Task::kTimed), Verdict::kCom, 1);
}

TEST_F(PathTest, PointsBetweenAreHeldToTheLimitsAndToNumbers) {
  Eigen::VectorXd x = up_;
  x[kRightShoulder] = 2.01;
  ExpectPathFailure(By(x), Verdict::kJointLimit, 0);
  x[kRightShoulder] = std::nan("");
  ExpectPathFailure(By(x), Verdict::kNotFinite, 0);
}

TEST_F(PathTest, WaypointsAreJudgedAsThoseOfAMotion) {
  Eigen::VectorXd x = up_;
  x[kBaseY] = 0.0015;  // between the tolerances
  const Evaluation evaluation = Judged(standing_twice_, {{0, up_}, {1, x}, {2, up_}, {3, up_}});
  ExpectPathFailure(evaluation, Verdict::kFootPose, 1);
  EXPECT_EQ(evaluation.detail, "waypoint 1: l_foot translation y off by 1.5 mm (tolerance 1 mm)");
}

TEST_F(PathTest, StampsThatAreWrongAreAVerdictWithTheirReason) {
  const Evaluation evaluation = Judged(standing_twice_, {{0, up_}, {1, up_}, {0.5, up_}, {2, up_}, {3, up_}});
  ExpectPathFailure(evaluation, Verdict::kWrongSize, 1);
  EXPECT_EQ(evaluation.detail, "waypoint 1: point 2 (time 0.5) is not later than the point before it, at 1");
  EXPECT_TRUE(std::isnan(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral)));
}

}  // namespace
}  // namespace legopt
