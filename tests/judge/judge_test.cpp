#include "legopt/judge/judge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::kBaseX;
using test::kBaseY;
using test::kLeftShoulder;
using test::kNeck;
using test::kQuaternionW;
using test::kRightShoulder;
using test::kSyntheticDofs;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kGravity = 9.797930195020351;

class JudgeTest : public testing::Test {
 protected:
  Evaluation Posture(const Eigen::VectorXd& x) { return judge_.Evaluate(Task::kPosture, posture_, {&x, 1}); }
  Evaluation Motion(const std::vector<Eigen::VectorXd>& waypoints) {
    return judge_.Evaluate(Task::kMotion, standing_twice_, waypoints);
  }
  /// Returns the argument in [low, high] at which an increasing function reaches `value`.
  static double Solve(const std::function<double(double)>& function, double value, double low, double high) {
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (function(middle) < value ? low : high) = middle;
    }
    return (low + high) / 2;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  Judge judge_{dataset_};
  ProblemDefinition posture_ = dataset_->problem(Task::kPosture, 0);
  ProblemDefinition standing_twice_{.id = 1, .stances = {posture_.stances[0], posture_.stances[0]}};
};

void ExpectFailure(const Evaluation& evaluation, Verdict verdict, int waypoint) {
  EXPECT_EQ(ToString(evaluation.literal), ToString(verdict)) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, evaluation.literal);
  EXPECT_EQ(evaluation.solid, evaluation.literal);
  EXPECT_EQ(evaluation.failed_waypoint, waypoint);
  EXPECT_TRUE(std::isnan(evaluation.cost));
  EXPECT_NE(evaluation.detail, "");
}

TEST_F(JudgeTest, UprightPostureSucceedsAndCostsItsGravityTorques) {
  Eigen::VectorXd x = test::StandingUpright();
  x[kRightShoulder] = 0.5;
  x.tail<4>() *= 1.094;  // quaternions of solution files need not be unit
  const Evaluation evaluation = Posture(x);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess);
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess);
  EXPECT_EQ(evaluation.failed_waypoint, -1);
  EXPECT_EQ(evaluation.detail, "");
  EXPECT_EQ(evaluation.num_waypoints, 1);
  EXPECT_NEAR(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 0, 1e-12);
  EXPECT_EQ(evaluation.Largest(Verdict::kCom, Rule::kLiteral), 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kJointLimit, Rule::kLiteral), 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral), 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kSelfCollision, Rule::kLiteral), 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict), 0);
  EXPECT_EQ(evaluation.SolidDepth_m(), 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kStep, Rule::kSolid), 0);
  // Feet are 0.03 m ahead of hips and ankles, the right arm's mass has a lever of 0.2 sin(0.5), the neck carries the
  // head.
  const double foot = 1 * 0.03;
  const double arm = 1.5 * 0.2 * std::sin(0.5);
  EXPECT_NEAR(evaluation.cost, kGravity * kGravity * (4 * foot * foot + arm * arm + 1), 1e-9);
}

TEST_F(JudgeTest, FootTranslation) {
  Eigen::VectorXd x = test::StandingUpright();
  x[kBaseY] = 0.002;
  const Evaluation evaluation = Posture(x);
  ExpectFailure(evaluation, Verdict::kFootPose, 0);
  EXPECT_EQ(evaluation.detail, "waypoint 0: l_foot translation y off by 2 mm (tolerance 1 mm)");
  EXPECT_NEAR(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 0.002, 1e-12);
  EXPECT_TRUE(std::isnan(evaluation.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral)))
      << "collisions are not looked at after phase A failed";
  x[kBaseY] = 0.000999;
  EXPECT_EQ(Posture(x).literal, Verdict::kSuccess);
}

TEST_F(JudgeTest, FootRotationIsMeasuredOnTheQuaternion) {
  Eigen::VectorXd x = test::StandingUpright();
  const auto turn = [&](double yaw) {
    x[kQuaternionW] = std::cos(yaw / 2);
    x[kQuaternionW + 3] = std::sin(yaw / 2);
  };
  turn(0.0019);  // quaternion component 0.00095: within 1e-3 although the angle is above
  EXPECT_EQ(Posture(x).literal, Verdict::kSuccess);
  turn(0.0021);
  const Evaluation evaluation = Posture(x);
  ExpectFailure(evaluation, Verdict::kFootPose, 0);
  EXPECT_THAT(evaluation.detail, AllOf(HasSubstr("l_foot rotation about z"), HasSubstr("0.00105")));
}

TEST_F(JudgeTest, FootThatIsNotListedIsFree) {
  const Stance one_foot{{posture_.stances[0].contacts[0]}};
  Eigen::VectorXd x = test::StandingUpright();
  x[test::kRightHip] = -0.5;
  const Evaluation evaluation = judge_.Evaluate(Task::kPosture, {.id = 5, .stances = {one_foot}}, {&x, 1});
  EXPECT_EQ(evaluation.literal, Verdict::kCom);
  EXPECT_LT(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 1e-12);
}

TEST_F(JudgeTest, CentreOfMassHasATolerance) {
  const auto com_x = [&](double lean) {
    Kinematics kinematics(dataset_->robot());
    kinematics.Update(test::Leaning(lean));
    return kinematics.com().x();
  };
  constexpr double kToe_m = 0.13;
  const Evaluation inside = Posture(test::Leaning(Solve(com_x, kToe_m + 0.0009, 0, 1)));
  EXPECT_EQ(inside.literal, Verdict::kSuccess) << inside.detail;
  EXPECT_NEAR(inside.Largest(Verdict::kCom, Rule::kLiteral), 0.0009, 1e-12);
  const Evaluation outside = Posture(test::Leaning(Solve(com_x, kToe_m + 0.0015, 0, 1)));
  ExpectFailure(outside, Verdict::kCom, 0);
  EXPECT_EQ(outside.detail, "waypoint 0: centre of mass 1.5 mm outside the support polygon (tolerance 1 mm)");
  EXPECT_NEAR(outside.Largest(Verdict::kCom, Rule::kLiteral), 0.0015, 1e-12);
}

TEST_F(JudgeTest, LimitsApplyToTheRawVectorKinematicsToTheClampedOne) {
  Eigen::VectorXd x = test::StandingUpright();
  x[kRightShoulder] = 2.0009;
  const Evaluation inside = Posture(x);
  EXPECT_EQ(inside.literal, Verdict::kSuccess) << inside.detail;
  EXPECT_NEAR(inside.Largest(Verdict::kJointLimit, Rule::kLiteral), 0.0009, 1e-12);
  x[kRightShoulder] = 2;
  EXPECT_EQ(inside.cost, Posture(x).cost);
  x[kRightShoulder] = 2.01;
  const Evaluation outside = Posture(x);
  ExpectFailure(outside, Verdict::kJointLimit, 0);
  EXPECT_EQ(outside.detail, "waypoint 0: r_shoulder = 2.01 is 0.01 rad above its limit 2 (tolerance 0.001 rad)");

  x = test::StandingUpright();
  x[kNeck] = -0.5;
  EXPECT_EQ(Posture(x).detail, "waypoint 0: neck = -0.5 is 0.5 m below its limit 0 (tolerance 0.001 m)");
}

// A joint without limits has those of the original evaluator, +-1e4, so that no accepted cost overflows.
TEST_F(JudgeTest, UnlimitedJointsHaveTheOriginalLimits) {
  Eigen::VectorXd x = test::StandingUpright();
  for (const double inside : {1e4, -1e4, 1e4 + 0.9e-3}) {
    x[test::kLidar] = inside;
    EXPECT_EQ(Posture(x).literal, Verdict::kSuccess) << inside;
  }
  for (const double outside : {1e4 + 1.1e-3, -1e4 - 1.1e-3, 1e6, -1e300}) {
    x[test::kLidar] = outside;
    ExpectFailure(Posture(x), Verdict::kJointLimit, 0);
    EXPECT_THAT(Posture(x).detail, HasSubstr("lidar = ")) << outside;
  }
  std::vector<Eigen::VectorXd> waypoints(4, test::StandingUpright());
  for (size_t w = 0; w < waypoints.size(); ++w) waypoints[w][test::kLidar] = w % 2 == 0 ? 1e4 : -1e4;
  EXPECT_EQ(Motion(waypoints).literal, Verdict::kSuccess);
  EXPECT_EQ(Motion(waypoints).cost, 3 * 2e4 * 2e4 / 4);
  waypoints[2][test::kLidar] = -1e300;
  ExpectFailure(Motion(waypoints), Verdict::kJointLimit, 2);
}

TEST_F(JudgeTest, FootComesBeforeComBeforeLimit) {
  Eigen::VectorXd x = test::Leaning(0.9);
  x[kRightShoulder] = 3;
  Evaluation evaluation = Posture(x);
  ExpectFailure(evaluation, Verdict::kCom, 0);
  EXPECT_NEAR(evaluation.Largest(Verdict::kJointLimit, Rule::kLiteral), 1, 1e-12)
      << "recorded although another check failed first";
  x[kBaseX] += 0.01;
  evaluation = Posture(x);
  ExpectFailure(evaluation, Verdict::kFootPose, 0);
  EXPECT_GT(evaluation.Largest(Verdict::kCom, Rule::kLiteral), 0.1);
}

TEST_F(JudgeTest, ArmInTheColumn) {
  Eigen::VectorXd x = test::StandingUpright();
  x[kLeftShoulder] = 1.2;
  const Evaluation evaluation = Posture(x);
  ExpectFailure(evaluation, Verdict::kEnvironmentCollision, 0);
  EXPECT_THAT(evaluation.detail, AllOf(HasSubstr("l_arm is "), HasSubstr("deep in 'column' of the scene")));
  EXPECT_GT(evaluation.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral), 1e-3);
  EXPECT_EQ(evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict), 0) << "all that can be evaluated is";
}

TEST_F(JudgeTest, ArmInTheLeg) {
  Eigen::VectorXd x = test::StandingUpright();
  x[kLeftShoulder] = -0.35;
  const Evaluation evaluation = Posture(x);
  ExpectFailure(evaluation, Verdict::kSelfCollision, 0);
  EXPECT_THAT(evaluation.detail, HasSubstr("l_leg and l_arm overlap by"));
}

TEST_F(JudgeTest, OriginalRuleChecksOnlyTheLastCollidingPair) {
  // The right arm penetrates its leg by less than the tolerance, the left one deeply: the original evaluator checks
  // only the right pair, because it is the last.
  Eigen::VectorXd x = test::StandingUpright();
  const auto depth = [&](double swing) {
    x[kRightShoulder] = -swing;
    return Posture(x).Largest(Verdict::kSelfCollision, Rule::kLiteral);
  };
  depth(Solve(depth, 5e-4, 0, 0.3));
  EXPECT_EQ(Posture(x).strict, Verdict::kSuccess);
  EXPECT_GT(Posture(x).Largest(Verdict::kSelfCollision, Rule::kStrict), 0);
  x[kLeftShoulder] = -0.35;
  const Evaluation evaluation = Posture(x);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess);
  EXPECT_EQ(evaluation.strict, Verdict::kSelfCollision);
  EXPECT_EQ(evaluation.solid, Verdict::kSelfCollision) << "it demands what the strict rule does";
  EXPECT_EQ(evaluation.SolidDepth_m(), evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict));
  EXPECT_LT(evaluation.Largest(Verdict::kSelfCollision, Rule::kLiteral), 1e-3);
  EXPECT_GT(evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict), 1e-2);
  EXPECT_EQ(evaluation.failed_waypoint, 0);
  EXPECT_THAT(evaluation.detail, AllOf(HasSubstr("by the strict rule, "), HasSubstr("l_leg and l_arm")));
  EXPECT_FALSE(std::isnan(evaluation.cost)) << "feasible by the literal rule";
}

/// Moves a problem and its solution, so that the feet stay on their targets.
void Shift(const Eigen::Vector3d& d, ProblemDefinition* problem, Eigen::VectorXd* x) {
  for (Stance& stance : problem->stances) {
    for (ContactTarget& target : stance.contacts) target.position += d;
  }
  x->segment<3>(kBaseX) += d;
}

void ExpectSolidFailure(const Evaluation& evaluation, Verdict verdict, int waypoint) {
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess);
  EXPECT_EQ(ToString(evaluation.solid), ToString(verdict)) << evaluation.detail;
  EXPECT_EQ(evaluation.by(Rule::kSolid), evaluation.solid);
  EXPECT_EQ(evaluation.failed_waypoint, waypoint);
  EXPECT_THAT(evaluation.detail, HasSubstr("by the solid rule, "));
  EXPECT_FALSE(std::isnan(evaluation.cost)) << "feasible by the literal rule";
}

/// Returns the dataset with a text replaced in one of its files.
std::shared_ptr<const Dataset> Changed(const std::filesystem::path& folder, const char* file, const std::string& from,
                                       const std::string& to) {
  const std::filesystem::path path = test::SyntheticFolder(folder).path();
  test::ReplaceInFile(path / file, from, to);
  WriteManifestHashes(path);
  return Dataset::Load(path);
}

TEST_F(JudgeTest, SolidRuleSeesTheRobotWhollyInsideOfTheGround) {
  const test::TemporaryFolder folder;
  Judge judge(Changed(folder.path(), "scene.yaml", "size: [20, 20, 0.5], position: [0, 0, -0.25]",
                      "size: [20, 20, 5], position: [0, 0, -2.5]"));
  Eigen::VectorXd x = test::StandingUpright();
  ASSERT_EQ(judge.Evaluate(Task::kPosture, posture_, {&x, 1}).solid, Verdict::kSuccess);
  ProblemDefinition buried = posture_;
  Shift({-4, 0, -3}, &buried, &x);
  const Evaluation evaluation = judge.Evaluate(Task::kPosture, buried, {&x, 1});
  ExpectSolidFailure(evaluation, Verdict::kContainment, 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral), 0);
  EXPECT_NEAR(evaluation.SolidDepth_m(), 2.499, 0.5);
  EXPECT_THAT(evaluation.detail, HasSubstr("'ground' of the scene have a vertex 2."));
}

TEST_F(JudgeTest, SolidRuleSeesPairsThatTheReferencePoseIgnores) {
  const test::TemporaryFolder folder;
  Judge judge(Changed(folder.path(), "dataset.yaml", "{l_shoulder: 0,", "{l_shoulder: -0.35,"));
  Eigen::VectorXd x = test::StandingUpright();
  ASSERT_EQ(judge.Evaluate(Task::kPosture, posture_, {&x, 1}).solid, Verdict::kSuccess);
  x[kLeftShoulder] = -0.35;
  ASSERT_EQ(Posture(x).strict, Verdict::kSelfCollision) << "with the pair compared";
  const Evaluation evaluation = judge.Evaluate(Task::kPosture, posture_, {&x, 1});
  ExpectSolidFailure(evaluation, Verdict::kSelfCollision, 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict), 0);
  EXPECT_NEAR(evaluation.SolidDepth_m(), Posture(x).Largest(Verdict::kSelfCollision, Rule::kStrict),
              1e-6);  // computed without ODE's single
                      // precision
  EXPECT_THAT(evaluation.detail, HasSubstr("l_leg and l_arm overlap by"));
}

TEST_F(JudgeTest, SolidRuleBoundsTheStepBetweenWaypoints) {
  const double limit_m = kStepShare * dataset_->robot_bounds().diagonal().norm();
  for (const double share : {0.99, 1.01}) {
    Eigen::VectorXd x = test::StandingUpright();
    ProblemDefinition moved = posture_;
    Shift({-share * limit_m, 0, 0}, &moved, &x);
    const ProblemDefinition jump{.id = 1, .stances = {posture_.stances[0], moved.stances[0]}};
    const std::vector<Eigen::VectorXd> waypoints = {test::StandingUpright(), test::StandingUpright(), x, x};
    const Evaluation evaluation = judge_.Evaluate(Task::kMotion, jump, waypoints);
    EXPECT_NEAR(evaluation.Largest(Verdict::kStep, Rule::kSolid), share * limit_m, 1e-12);
    if (share < 1.0) {
      EXPECT_EQ(evaluation.solid, Verdict::kSuccess) << evaluation.detail;
    } else {
      ExpectSolidFailure(evaluation, Verdict::kStep, 2);
      EXPECT_THAT(evaluation.detail, HasSubstr("from the waypoint before"));
    }
  }
}

TEST_F(JudgeTest, DetailIsOfTheMostLenientRuleThatFails) {
  std::vector<Eigen::VectorXd> waypoints(4, test::StandingUpright());
  waypoints[3][kLeftShoulder] = 1.2;  // into the column, by all rules
  ProblemDefinition far = posture_;
  Shift({-4, 0, 0}, &far, &waypoints[0]);  // a jump to the next stance, by the solid rule
  waypoints[1] = waypoints[0];
  const ProblemDefinition jump{.id = 1, .stances = {far.stances[0], posture_.stances[0]}};
  const Evaluation evaluation = judge_.Evaluate(Task::kMotion, jump, waypoints);
  EXPECT_NEAR(evaluation.Largest(Verdict::kStep, Rule::kSolid), 4.0, 1e-12);
  EXPECT_EQ(evaluation.solid, Verdict::kStep);
  EXPECT_EQ(evaluation.strict, Verdict::kEnvironmentCollision);
  EXPECT_EQ(evaluation.literal, Verdict::kEnvironmentCollision);
  EXPECT_EQ(evaluation.failed_waypoint, 3);
  EXPECT_THAT(evaluation.detail, HasSubstr("waypoint 3: l_arm is"));
}

// Compares figures with and without culling over many kinds of postures.
TEST_F(JudgeTest, CullingChangesNothing) {
  Judge exhaustive(dataset_, Culling::kOff);
  for (const double left : {-0.35, 0.0, 1.2}) {
    for (const double right : {-0.3, 0.0, 2.0}) {
      Eigen::VectorXd x = test::StandingUpright();
      x[kLeftShoulder] = left;
      x[kRightShoulder] = right;
      const Evaluation a = Posture(x), b = exhaustive.Evaluate(Task::kPosture, posture_, {&x, 1});
      for (const auto& rule : kEnumNames<Rule>) EXPECT_EQ(a.by(rule.value), b.by(rule.value)) << rule.word;
      EXPECT_EQ(a.detail, b.detail);
      EXPECT_EQ(a.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral),
                b.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral));
      EXPECT_EQ(a.Largest(Verdict::kSelfCollision, Rule::kLiteral), b.Largest(Verdict::kSelfCollision, Rule::kLiteral));
      EXPECT_EQ(a.Largest(Verdict::kSelfCollision, Rule::kStrict), b.Largest(Verdict::kSelfCollision, Rule::kStrict));
      EXPECT_EQ(a.SolidDepth_m(), b.SolidDepth_m());
    }
  }
}

TEST_F(JudgeTest, WrongNumberOfWaypoints) {
  const Evaluation none = judge_.Evaluate(Task::kPosture, posture_, {});
  ExpectFailure(none, Verdict::kWrongWaypointCount, -1);
  EXPECT_EQ(none.detail, "0 waypoints instead of 1");
  const Evaluation evaluation = Motion(std::vector<Eigen::VectorXd>(3, test::StandingUpright()));
  ExpectFailure(evaluation, Verdict::kWrongWaypointCount, -1);
  EXPECT_EQ(evaluation.num_waypoints, 4);
  EXPECT_TRUE(std::isnan(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral)));
}

TEST_F(JudgeTest, WrongSizeAndNotFinite) {
  const Evaluation small = Posture(test::StandingUpright().head(14));
  ExpectFailure(small, Verdict::kWrongSize, 0);
  EXPECT_EQ(small.detail, "waypoint 0: 14 numbers instead of 15");
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Eigen::VectorXd x = test::StandingUpright();
    x[3] = bad;
    ExpectFailure(Posture(x), Verdict::kNotFinite, 0);
    EXPECT_THAT(Posture(x).detail, HasSubstr("number 3 is"));
  }
  Eigen::VectorXd x = test::StandingUpright();
  x[kQuaternionW] = 0;
  ExpectFailure(Posture(x), Verdict::kNotFinite, 0);
  EXPECT_THAT(Posture(x).detail, HasSubstr("norm 0"));
}

TEST_F(JudgeTest, HugeNumbersFailWithoutHarm) {
  for (const int index : {kBaseX, kBaseY, test::kLidar, kQuaternionW, kQuaternionW + 1}) {
    for (const double value : {1e308, -1e308, 1e-320}) {
      Eigen::VectorXd x = test::StandingUpright();
      x[index] = value;
      const Evaluation evaluation = Posture(x);
      if (index == kBaseX && std::abs(value) > 1) ExpectFailure(evaluation, Verdict::kFootPose, 0);
    }
  }
}

TEST_F(JudgeTest, MotionCostIsTheMeanSquaredStepOfTheJoints) {
  std::vector<Eigen::VectorXd> waypoints(4, test::StandingUpright());
  waypoints[1][kRightShoulder] = 0.3;
  waypoints[2][kRightShoulder] = 0.3;
  waypoints[2][kNeck] = 0.05;
  waypoints[3][kNeck] = 0.05;
  waypoints[3][kBaseX] = 0.0005;  // the base is not part of the cost
  const Evaluation evaluation = Motion(waypoints);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.num_waypoints, 4);
  EXPECT_NEAR(evaluation.cost, (0.3 * 0.3 + 0.05 * 0.05 + 0.3 * 0.3) / 4, 1e-12);
}

TEST_F(JudgeTest, FirstFailingWaypointDecidesTheRestIsRecorded) {
  std::vector<Eigen::VectorXd> waypoints(4, test::StandingUpright());
  waypoints[1][kNeck] = 0.2;
  waypoints[2][kBaseY] = 0.03;
  waypoints[3] = waypoints[3].head(3).eval();
  Evaluation evaluation = Motion(waypoints);
  ExpectFailure(evaluation, Verdict::kJointLimit, 1);
  EXPECT_NEAR(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 0.03, 1e-12);
  waypoints[0][0] = std::numeric_limits<double>::quiet_NaN();
  ExpectFailure(Motion(waypoints), Verdict::kNotFinite, 0);
}

TEST_F(JudgeTest, CollisionsAreCheckedAfterPhaseAOfAllWaypoints) {
  std::vector<Eigen::VectorXd> waypoints(4, test::StandingUpright());
  waypoints[0][kLeftShoulder] = 1.2;
  ExpectFailure(Motion(waypoints), Verdict::kEnvironmentCollision, 0);
  waypoints[3][kBaseY] = 0.002;
  ExpectFailure(Motion(waypoints), Verdict::kFootPose, 3);
}

TEST_F(JudgeTest, EveryStanceConstrainsTwoWaypoints) {
  // In stance 1 of the dataset's motion only the left foot is in contact, where this robot cannot balance.
  const std::vector<Eigen::VectorXd> waypoints(6, test::StandingUpright());
  const Evaluation evaluation = judge_.Evaluate(Task::kMotion, dataset_->problem(Task::kMotion, 0), waypoints);
  ExpectFailure(evaluation, Verdict::kCom, 2);
  EXPECT_NEAR(evaluation.Largest(Verdict::kCom, Rule::kLiteral), 0.05, 1e-12);
}

TEST_F(JudgeTest, NoMemoryOfEarlierEvaluations) {
  Eigen::VectorXd bad = test::StandingUpright();
  bad[kLeftShoulder] = 1.2;
  const Evaluation first = Posture(test::StandingUpright());
  Posture(bad);
  const Evaluation again = Posture(test::StandingUpright());
  EXPECT_EQ(first.cost, again.cost);
  EXPECT_EQ(again.literal, Verdict::kSuccess);
}

TEST_F(JudgeTest, InitialGuessIsNoSolution) {
  const Eigen::VectorXd buried = InitialGuess(*dataset_, posture_.stances[0], Initialization::kInCollision);
  EXPECT_EQ(Posture(buried).literal, Verdict::kFootPose);
}

TEST_F(JudgeTest, ProblemsThatDoNotFitAreInputErrors) {
  const Eigen::VectorXd x = test::StandingUpright();
  ProblemDefinition problem = posture_;
  problem.stances[0].contacts[0].contact = "l_fot";
  EXPECT_THAT(test::MessageOf([&] {
                judge_.Evaluate(Task::kPosture, problem, {&x, 1});
              }),
              AllOf(HasSubstr("problem 0, definition, stance 0"), HasSubstr("did you mean 'l_foot'?"),
                    Not(HasSubstr("dataset.yaml"))));
  EXPECT_THAT(test::MessageOf([&] { judge_.Evaluate(Task::kMotion, posture_, {&x, 1}); }), HasSubstr("two or more"));
  EXPECT_THAT(test::MessageOf([&] {
                judge_.Evaluate(Task::kPosture, {.id = 0, .stances = {}}, {&x, 1});
              }),
              HasSubstr("0 stances"));
}

TEST(Verdicts, NamesRoundTrip) {
  for (const Verdict verdict :
       {Verdict::kSuccess, Verdict::kWrongWaypointCount, Verdict::kWrongSize, Verdict::kNotFinite, Verdict::kFootPose,
        Verdict::kCom, Verdict::kJointLimit, Verdict::kEnvironmentCollision, Verdict::kSelfCollision,
        Verdict::kContainment, Verdict::kStep}) {
    EXPECT_EQ(ParseEnum<Verdict>(ToString(verdict)), verdict);
  }
  EXPECT_EQ(ParseEnum<Verdict>("great"), std::nullopt);
  EXPECT_THAT(EnumChoices<Verdict>(), HasSubstr("'environment_collision'"));
}

}  // namespace
}  // namespace legopt
