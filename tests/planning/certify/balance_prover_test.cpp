#include "legopt/planning/certify/internal/balance_prover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "legopt/dataset/internal/com_reach.h"
#include "legopt/math/random_numbers.h"
#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"
#include "tests/folders.h"

namespace legopt::certify {
namespace {

using ::testing::HasSubstr;

std::shared_ptr<const Dataset> Hands() { return Dataset::Load(SourceFolder() + "/data/hands-small"); }

TEST(ComReach, IsAboveTheDistanceInEveryPosture) {
  const auto dataset = Hands();
  const RobotModel& robot = dataset->robot();
  Kinematics kinematics(robot);
  std::mt19937_64 random(3);
  for (const Contact& contact : dataset->contacts()) {
    const double reach_m = ComReach_m(robot, contact);
    double furthest_m = 0.0;
    for (int trial = 0; trial < 2'000; ++trial) {
      Eigen::VectorXd x = robot.NeutralConfiguration();
      for (int dof = 0; dof < robot.num_dofs(); ++dof) {
        const double low = std::max(robot.lower_limits()[dof], -M_PI), high = std::min(robot.upper_limits()[dof], M_PI);
        x[dof] = low + (high - low) * UniformRandom(random);
      }
      kinematics.Update(x);
      const Eigen::Vector3d origin = kinematics.link_pose(contact.link_index) * contact.X_LC.translation();
      furthest_m = std::max(furthest_m, (kinematics.com() - origin).norm());
    }
    EXPECT_LT(furthest_m, reach_m) << contact.name;
    EXPECT_GT(furthest_m, 0.7 * reach_m) << contact.name << ": the bound says nothing";
  }
}

TEST(RefuteBalance, FindsHandsOutOfReachAndStancesThatSlide) {
  const auto dataset = Hands();
  const auto stance = [&](int id) { return dataset->problem(Task::kPosture, id).stances[0]; };
  for (int id = 0; id < 3; ++id) EXPECT_FALSE(RefuteBalance(*dataset, stance(id))) << id;
  Stance feet = stance(2);  // both hands 1.6 m ahead of the feet
  for (ContactTarget& target : feet.contacts) target.carries = target.contact.ends_with("foot");
  EXPECT_THAT(RefuteBalance(*dataset, feet).value_or(""), HasSubstr("m or more from l_palm, and reaches"));
  Stance pushed = stance(0);  // with the wall behind the hands, which then push downhill
  for (ContactTarget& target : pushed.contacts) {
    if (target.contact.ends_with("palm")) target.rotation = Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitY());
  }
  EXPECT_THAT(RefuteBalance(*dataset, pushed).value_or(""), HasSubstr("no forces within friction and bounds"));
}

}  // namespace
}  // namespace legopt::certify
