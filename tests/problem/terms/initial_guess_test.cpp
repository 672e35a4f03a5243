#include "legopt/problem/terms/initial_guess.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

/// Returns the height of the lowest corner of all feet's boxes.
double LowestSole(const Dataset& dataset, const Eigen::VectorXd& x) {
  Kinematics kinematics(dataset.robot());
  kinematics.Update(x);
  double lowest = 1e9;
  for (const Contact& foot : dataset.contacts()) {
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3d corner = foot.box_L.corner(static_cast<Eigen::AlignedBox3d::CornerType>(c));
      lowest = std::min(lowest, (kinematics.link_pose(foot.link_index) * corner).z());
    }
  }
  return lowest;
}

double YawOf(const Eigen::VectorXd& x) {
  const auto q = x.tail<4>();
  return 2 * std::atan2(q[3], q[0]);
}

ContactTarget TargetAt(const std::string& link, const Eigen::Vector3d& position, double yaw) {
  return {.contact = link,
          .position = position,
          .rotation = Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()))};
}

class InitialGuessTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
};

TEST_F(InitialGuessTest, SolesAboveTheHighestAndBelowTheLowestTarget) {
  const Stance stance{{TargetAt("l_foot", {1, 2, 0.5}, 0.2), TargetAt("r_foot", {3, 1, 0.8}, 0.4)}};
  const Eigen::VectorXd good = InitialGuess(*dataset_, stance, Initialization::kGood);
  const Eigen::VectorXd buried = InitialGuess(*dataset_, stance, Initialization::kInCollision);
  EXPECT_NEAR(LowestSole(*dataset_, good), 0.8 + 0.20, 1e-12);
  EXPECT_NEAR(LowestSole(*dataset_, buried), 0.5 - 0.05, 1e-12);
  for (const Eigen::VectorXd& x : {good, buried}) {
    ASSERT_EQ(x.size(), test::kSyntheticDofs + 7);
    EXPECT_EQ(x.head(test::kSyntheticDofs), dataset_->nominal_joints());
    EXPECT_NEAR(x[test::kSyntheticDofs], 2, 1e-15);
    EXPECT_NEAR(x[test::kSyntheticDofs + 1], 1.5, 1e-15);
    EXPECT_NEAR(YawOf(x), 0.3, 1e-12);
    EXPECT_EQ(x[test::kSyntheticDofs + 4], 0);
    EXPECT_EQ(x[test::kSyntheticDofs + 5], 0);
    EXPECT_NEAR(x.tail<4>().norm(), 1, 1e-15);
  }
}

TEST_F(InitialGuessTest, YawIsACircularMean) {
  const double pi = std::numbers::pi;
  const Stance stance{{TargetAt("l_foot", {0, 0, 0}, pi - 0.1), TargetAt("r_foot", {0, 0, 0}, -pi + 0.3)}};
  const double yaw = YawOf(InitialGuess(*dataset_, stance, Initialization::kGood));
  EXPECT_NEAR(std::remainder(yaw - (pi + 0.1), 2 * pi), 0, 1e-12);
}

TEST_F(InitialGuessTest, OneFootIsItsOwnCentre) {
  const Stance stance{{TargetAt("r_foot", {3, 1, 0.8}, -2)}};
  const Eigen::VectorXd x = InitialGuess(*dataset_, stance, Initialization::kGood);
  EXPECT_NEAR(x[test::kSyntheticDofs], 3, 1e-15);
  EXPECT_NEAR(YawOf(x), -2, 1e-12);
}

TEST_F(InitialGuessTest, PerturbationStaysInRangeAndLimitsAndIsReproducible) {
  const RobotModel& robot = dataset_->robot();
  const Eigen::VectorXd start =
      InitialGuess(*dataset_, dataset_->problem(Task::kPosture, 0).stances[0], Initialization::kGood);
  constexpr double kHalfWidth_rad = 5 * std::numbers::pi / 180;
  std::mt19937_64 a(11), b(11);
  double largest = 0;
  for (int i = 0; i < 100; ++i) {
    Eigen::VectorXd x = start, y = start;
    PerturbJoints(robot, a, kHalfWidth_rad, x);
    PerturbJoints(robot, b, kHalfWidth_rad, y);
    EXPECT_EQ(x, y);
    EXPECT_EQ(x.tail<7>(), start.tail<7>());
    const Eigen::VectorXd noise = x.head(robot.num_dofs()) - start.head(robot.num_dofs());
    largest = std::max(largest, noise.cwiseAbs().maxCoeff());
    EXPECT_LE(noise.cwiseAbs().maxCoeff(), kHalfWidth_rad);
    EXPECT_LE(x[test::kNeck], 0.1);  // starts at its upper limit
    EXPECT_TRUE((x.head(robot.num_dofs()).array() >= robot.lower_limits().array()).all());
  }
  EXPECT_GT(largest, 0.95 * kHalfWidth_rad);
}

TEST_F(InitialGuessTest, PerturbationIsTheSameOnEveryMachine) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(test::kSyntheticDofs + 7);
  std::mt19937_64 generator(5489);  // the default seed; the standard specifies an output for it
  PerturbJoints(dataset_->robot(), generator, 1, x);
  // First output of mt19937_64 with this seed: 14514284786278117030.
  EXPECT_EQ(x[0], 2 * std::ldexp(static_cast<double>(14514284786278117030ULL >> 11), -53) - 1);
}

TEST(InitialGuessAtlas, HeightsAndYawOfTheLegOptProblems) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  // Computed independently: soles below the pelvis with the nominal legs, the right foot is lower.
  EXPECT_NEAR(dataset->nominal_sole_height_m(), -0.873903, 1e-6);
  for (const ProblemDefinition& problem : dataset->problems(Task::kPosture)) {
    const auto& feet = problem.stances[0].contacts;
    const double low = std::min(feet[0].position.z(), feet[1].position.z());
    const double high = std::max(feet[0].position.z(), feet[1].position.z());
    const Eigen::VectorXd good = InitialGuess(*dataset, problem.stances[0], Initialization::kGood);
    const Eigen::VectorXd buried = InitialGuess(*dataset, problem.stances[0], Initialization::kInCollision);
    EXPECT_NEAR(LowestSole(*dataset, good), high + 0.20, 1e-12);
    EXPECT_NEAR(LowestSole(*dataset, buried), low - 0.05, 1e-12);
    const Eigen::Vector2d centre = (feet[0].position + feet[1].position).head<2>() / 2;
    EXPECT_NEAR((good.segment<2>(29) - centre).norm(), 0, 1e-12);
    const auto yaw = [](const ContactTarget& f) {
      const Eigen::Vector3d x = f.rotation.toRotationMatrix().col(0);
      return std::atan2(x.y(), x.x());
    };
    const double to_left = std::remainder(YawOf(good) - yaw(feet[0]), 2 * std::numbers::pi);
    const double to_right = std::remainder(YawOf(good) - yaw(feet[1]), 2 * std::numbers::pi);
    EXPECT_NEAR(to_left, -to_right, 1e-9) << "problem " << problem.id;
    EXPECT_LT(std::abs(to_left), 0.2);
  }
}

TEST(InitialGuessOfHands, HandsFarAheadDrawTheTrunkForwards) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/hands-small");
  const Stance stance = dataset->problem(Task::kPosture, 2).stances[0];  // hands on blocks 1.6 m ahead, 0.6 m high
  Stance feet = stance;
  feet.contacts.resize(2);
  const Eigen::VectorXd with = InitialGuess(*dataset, stance, Initialization::kGood);
  const Eigen::VectorXd without = InitialGuess(*dataset, feet, Initialization::kGood);
  const int base = dataset->robot().base_position_index();
  double mean = 0.0;
  for (const ContactTarget& target : stance.contacts) {
    mean += 0.25 * (target.position.x() - dataset->contact(target.contact).nominal_position_B.x());
  }
  EXPECT_NEAR(with[base], mean, 1e-12);
  EXPECT_GT(with[base], without[base] + 0.3);
  EXPECT_EQ(with[base + 2], without[base + 2]) << "the feet decide about the height";
  EXPECT_EQ(with.tail<4>(), without.tail<4>());
}

TEST(InitialGuessOfHands, ArmsBringHandsNearTheirTargets) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/contacts-humanoid");
  const RobotModel& robot = dataset->robot();
  Kinematics kinematics(robot);
  int near = 0, all = 0;
  for (const ProblemDefinition& problem : dataset->problems(Task::kPosture)) {
    const Stance& stance = problem.stances.front();
    Eigen::VectorXd x = InitialGuess(*dataset, stance, Initialization::kGood);
    const Eigen::VectorXd buried = InitialGuess(*dataset, stance, Initialization::kInCollision);
    EXPECT_EQ(x.head(robot.num_dofs()), buried.head(robot.num_dofs())) << "the same arms, whatever the height";
    double lowest = 1e9, highest = -1e9;
    for (const ContactTarget& target : stance.contacts) {
      if (!dataset->contact(target.contact).facts().supports) continue;
      lowest = std::min(lowest, target.position.z());
      highest = std::max(highest, target.position.z());
    }
    x[robot.base_position_index() + 2] = 0.5 * (lowest + highest) - dataset->nominal_sole_height_m();
    kinematics.Update(x);
    for (const ContactTarget& target : stance.contacts) {
      const Contact& contact = dataset->contact(target.contact);
      if (contact.facts().supports) continue;
      const Eigen::Isometry3d X_WC = kinematics.link_pose(contact.link_index) * contact.X_LC;
      near += (X_WC.translation() - contact.OriginTarget(target)).norm() < 0.3 ? 1 : 0;
      ++all;
    }
    for (int dof = 0; dof < robot.num_dofs(); ++dof) {
      EXPECT_GE(x[dof], robot.lower_limits()[dof]);
      EXPECT_LE(x[dof], robot.upper_limits()[dof]);
    }
    const int leg = robot.joints()[static_cast<size_t>(robot.FindJoint("l_leg_kny"))].dof;
    EXPECT_EQ(x[leg], dataset->nominal_joints()[leg]) << "legs stay";
  }
  EXPECT_GT(near, all / 2);  // hands far ahead or high stay out of reach until the trunk moves
}

}  // namespace
}  // namespace legopt
