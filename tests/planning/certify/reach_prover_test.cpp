// Proofs of infeasibility. A stance that has a posture is never declared infeasible, for any robot. Feet that are out
// of reach, twisted or too high are proved infeasible.

#include "legopt/planning/certify/internal/reach_prover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "legopt/math/random_numbers.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt::certify {
namespace {

using Eigen::Vector3d;

double DrawBetween(double low, double high, std::mt19937_64& generator) {
  return low + (high - low) * UniformRandom(generator);
}

/// Returns a random configuration within the limits; every third one has all joints at a limit.
Eigen::VectorXd AnyConfiguration(const RobotModel& robot, int number, std::mt19937_64& generator) {
  Eigen::VectorXd x(robot.configuration_size());
  for (int i = 0; i < robot.num_dofs(); ++i) {
    const double low = std::max(robot.lower_limits()[i], -3.0);
    const double high = std::min(robot.upper_limits()[i], 3.0);
    const double draw = UniformRandom(generator);
    x[i] = low + (high - low) * (number % 3 == 0 ? std::round(draw) : draw);
  }
  for (Eigen::Index i = robot.num_dofs(); i < x.size(); ++i) x[i] = DrawBetween(-2.0, 2.0, generator);
  x.tail<4>().normalize();
  return x;
}

/// Returns the stance of this configuration on all feet, or on the first, with each foot off by nearly the judge's
/// tolerance.
Stance StanceOf(const Dataset& dataset, const Eigen::VectorXd& x, std::size_t feet, std::mt19937_64& generator) {
  constexpr double kNearlyAll = 0.99e-3;
  const auto off = [&generator] { return UniformRandom(generator) < 0.5 ? -kNearlyAll : kNearlyAll; };
  Kinematics kinematics(dataset.robot());
  kinematics.UpdatePoses(x);
  Stance stance;
  for (std::size_t f = 0; f < feet; ++f) {
    const Contact& foot = dataset.contacts()[f];
    Eigen::Isometry3d pose = kinematics.link_pose(foot.link_index);
    pose.translate(Vector3d(off(), off(), off()));
    pose.rotate(Eigen::Quaterniond(1.0, off(), off(), off()).normalized());
    stance.contacts.push_back({foot.link, pose.translation() - foot.link_height_m() * pose.linear().col(2),
                               Eigen::Quaterniond(pose.linear())});
  }
  return stance;
}

std::shared_ptr<const Dataset> Humanoid() { return Dataset::Load(SourceFolder() + "/data/garage-small"); }

/// Returns a prover shared by all tests: measuring the legs' reach takes a second, and minutes under sanitizers.
const ReachProver& HumanoidProver() {
  static const std::shared_ptr<const Dataset> dataset = Humanoid();
  static const ReachProver prover(*dataset);
  return prover;
}

void ExpectSound(const ReachProver& prover, const Dataset& dataset, int count, int most_cells) {
  std::mt19937_64 generator(1);
  for (int number = 0; number < count; ++number) {
    const Eigen::VectorXd x = AnyConfiguration(dataset.robot(), number, generator);
    const Stance stance = StanceOf(dataset, x, number % 5 == 4 ? 1 : dataset.contacts().size(), generator);
    Kinematics kinematics(dataset.robot());
    kinematics.UpdatePoses(x);
    ASSERT_TRUE(prover.Allows(stance, kinematics.link_pose(0))) << number;
    ASSERT_EQ(prover.Refute(stance, most_cells), std::nullopt) << number;
  }
}

TEST(ReachProof, IsNeverOfAStanceThatTheHumanoidStandsIn) { ExpectSound(HumanoidProver(), *Humanoid(), 3000, 3000); }

TEST(ReachProof, IsNeverOfOneThatFewRobotsCouldStandIn) {
  ExpectSound(HumanoidProver(), *Humanoid(), 20, ReachProver::kMaxCells);
}

TEST(ReachProof, IsNeverOfAStanceThatAStiffRobotStandsIn) {
  const test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  const auto dataset = Dataset::Load(folder.path());
  ExpectSound(ReachProver(*dataset), *dataset, 300, 3000);
}

TEST(ReachProof, IsNeverOfTheEmbeddedProblems) {
  const auto dataset = Humanoid();
  for (const ProblemDefinition& problem : dataset->problems(Task::kPosture)) {
    EXPECT_EQ(HumanoidProver().Refute(problem.stances.front()), std::nullopt) << problem.id;
  }
}

class Refutation : public testing::Test {
 protected:
  Refutation() {
    for (const auto& [link, y] : {std::pair("l_foot", 0.15), std::pair("r_foot", -0.15)}) {
      stance_.contacts.push_back({link, Vector3d(1.0, 2.0 + y, 0.3), Eigen::Quaterniond::Identity()});
    }
  }
  ContactTarget& right() { return stance_.contacts[1]; }

  const ReachProver& prover_ = HumanoidProver();
  Stance stance_;  // level, feet side by side
};

TEST_F(Refutation, OfFeetApart) {
  EXPECT_EQ(prover_.Refute(stance_), std::nullopt);
  right().position.y() -= 2.0;
  const auto proof = prover_.Refute(stance_);
  ASSERT_TRUE(proof);
  EXPECT_THAT(*proof, testing::HasSubstr("l_foot and r_foot"));
  EXPECT_EQ(prover_.Refute(stance_, 4), std::nullopt) << "not within so few cells";
}

TEST_F(Refutation, OfOneFootTooHigh) {
  right().position.z() += 1.6;
  EXPECT_TRUE(prover_.Refute(stance_));
}

TEST_F(Refutation, OfFeetThatPointAgainstEachOther) {
  right().rotation = Eigen::AngleAxisd(M_PI, Vector3d::UnitZ());
  right().position.y() -= 1.0;
  EXPECT_TRUE(prover_.Refute(stance_));
}

TEST_F(Refutation, DependsOnThePlaceOfTheStanceInNoWay) {
  right().position.y() -= 2.0;
  for (ContactTarget& target : stance_.contacts) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.4, Vector3d(1.0, 2.0, 3.0).normalized()));
    target.position = turn * target.position + Vector3d(-30.0, 20.0, 7.0);
    target.rotation = turn * target.rotation;
  }
  EXPECT_TRUE(prover_.Refute(stance_));
}

}  // namespace
}  // namespace legopt::certify
