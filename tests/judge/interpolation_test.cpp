// Policy: between two waypoints a robot moves in a straight line, its base along the shortest rotation. Collisions in
// between are measured for every verdict.
#include <gtest/gtest.h>

#include <cmath>

#include "legopt/judge/internal/path_examiner.h"
#include "legopt/judge/judge.h"
#include "legopt/robot/configuration.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::kBaseX;
using test::kBaseY;
using test::kLeftShoulder;
using test::kQuaternionW;

class InterpolationTest : public testing::Test {
 protected:
  Evaluation Motion(const std::vector<Eigen::VectorXd>& waypoints) {
    return judge_.Evaluate(Task::kMotion, standing_twice_, waypoints);
  }
  Eigen::VectorXd TransitionRule(const Eigen::VectorXd& a, const Eigen::VectorXd& b, double t) {
    Eigen::VectorXd x(a.size());
    InterpolateConfiguration(a, b, t, x);
    return x;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  Judge judge_{dataset_};
  Stance stance_ = dataset_->problem(Task::kPosture, 0).stances[0];
  ProblemDefinition standing_twice_{.id = 1, .stances = {stance_, stance_}};
};

TEST_F(InterpolationTest, JointsAndPositionAreLinearRotationIsTheGeodesic) {
  const Eigen::VectorXd a = test::StandingUpright();
  Eigen::VectorXd b = a;
  b[kLeftShoulder] = 1;
  b[kBaseX] = 2;
  b[kQuaternionW] = std::cos(0.4);
  b[kQuaternionW + 3] = std::sin(0.4);
  for (const double sign : {1.0, -3.0}) {  // a quaternion and its negative are the same rotation, of any norm
    b.tail<4>() *= sign;
    const Eigen::VectorXd x = TransitionRule(a, b, 0.25);
    EXPECT_NEAR(x[kLeftShoulder], 0.25, 1e-15);
    EXPECT_NEAR(x[kBaseX], 0.5, 1e-15);
    EXPECT_NEAR(x[kQuaternionW], std::cos(0.1), 1e-12);
    EXPECT_NEAR(x[kQuaternionW + 3], std::sin(0.1), 1e-12);
  }
}

TEST_F(InterpolationTest, JointsAreClampedFirst) {
  const double limit = dataset_->robot().upper_limits()[kLeftShoulder];
  std::vector<Eigen::VectorXd> waypoints(4, test::StandingUpright());
  waypoints[2][kLeftShoulder] = limit;
  const InterpolationScore within = Motion(waypoints).interpolation;
  waypoints[2][kLeftShoulder] = 5 * limit;  // unclamped, the arm would turn several times
  const InterpolationScore beyond = Motion(waypoints).interpolation;
  EXPECT_EQ(beyond.environment_depth_m, within.environment_depth_m);
  EXPECT_EQ(beyond.self_depth_m, within.self_depth_m);
  EXPECT_EQ(beyond.free_share, within.free_share);
}

TEST_F(InterpolationTest, AMotionThatStandsStillIsFree) {
  const Evaluation evaluation = Motion(std::vector<Eigen::VectorXd>(4, test::StandingUpright()));
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.interpolation.environment_depth_m, 0);
  EXPECT_EQ(evaluation.interpolation.self_depth_m, 0);
  EXPECT_EQ(evaluation.interpolation.free_share, 1);
}

// Waypoints 2 and 3 are on different sides of the column at (0, 0.6), which is 0.2 m thick: only the segment between
// them collides with it.
TEST_F(InterpolationTest, CollisionsBetweenWaypointsDoNotChangeVerdicts) {
  const Eigen::VectorXd here = test::StandingUpright();
  Eigen::VectorXd there = here;
  there[kBaseY] = 1.2;
  const Evaluation still = Motion({here, here, there, there});
  EXPECT_EQ(still.literal, Verdict::kFootPose);
  EXPECT_EQ(still.failed_waypoint, 2);
  EXPECT_GT(still.interpolation.environment_depth_m, 0.05);
  EXPECT_EQ(still.interpolation.self_depth_m, 0);
  EXPECT_DOUBLE_EQ(still.interpolation.free_share, 2.0 / 3.0);
}

TEST_F(InterpolationTest, APartOfAMotionIsScoredAsFarAsItGoes) {
  const Evaluation evaluation = Motion({test::StandingUpright(), test::StandingUpright()});
  EXPECT_EQ(evaluation.literal, Verdict::kWrongWaypointCount);
  EXPECT_EQ(evaluation.interpolation.free_share, 1);
}

TEST_F(InterpolationTest, WhatHasNoPoseIsNotScored) {
  const Eigen::VectorXd good = test::StandingUpright();
  Eigen::VectorXd nan = good, huge = good, directionless = good;
  nan[0] = std::nan("");
  huge[kBaseX] = 1e300;
  directionless.tail<4>().setZero();
  const Eigen::VectorXd shorter = good.head(good.size() - 1);
  for (const Eigen::VectorXd& bad : {nan, huge, directionless, shorter}) {
    EXPECT_TRUE(std::isnan(Motion({good, good, bad, good}).interpolation.free_share));
  }
  EXPECT_TRUE(std::isnan(Motion({}).interpolation.free_share));
  EXPECT_TRUE(std::isnan(Motion({good}).interpolation.free_share));
  const ProblemDefinition posture = dataset_->problem(Task::kPosture, 0);
  EXPECT_TRUE(std::isnan(judge_.Evaluate(Task::kPosture, posture, {&good, 1}).interpolation.free_share));
}

}  // namespace
}  // namespace legopt
