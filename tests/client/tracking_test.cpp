// Policy: the simulation obeys mechanics, and a motion that is tracked with room to spare stays up.
#include <gtest/gtest.h>

#include "client/report/motion_path.h"
#include "client/tracking/force_distribution.h"
#include "client/tracking/rigid_body_world.h"
#include "client/tracking/tracked_motion.h"
#include "legopt/judge/solution_file.h"
#include "legopt/robot/configuration.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

const std::string kData = legopt::SourceFolder() + "/data/contacts-quadruped";

TEST(Tracking, NonNegativeLeastSquaresDropsWhatWouldBeNegative) {
  Eigen::MatrixXd A(3, 2);
  A << 1, 0, 0, 1, 1, 1;
  EXPECT_TRUE(NonNegativeLeastSquares(A, Eigen::Vector3d(1, 2, 3)).isApprox(Eigen::Vector2d(1, 2), 1e-12));
  // Without the bound it would be (1, -1).
  EXPECT_TRUE(NonNegativeLeastSquares(A, Eigen::Vector3d(1, -1, 0)).isApprox(Eigen::Vector2d(0.5, 0.0), 1e-12));
}

class SimulatedRobot : public testing::Test {
 protected:
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(kData);
  Eigen::VectorXd HighAbove() const {
    Eigen::VectorXd x = dataset_->robot().NeutralConfiguration();
    x.head(dataset_->robot().num_dofs()) = dataset_->nominal_joints();
    MutablePartsOf(x).base_position().z() = 10.0;
    return x;
  }
};

TEST_F(SimulatedRobot, FallsFreelyWithoutTurningOrMovingItsJoints) {
  RigidBodyWorld world(*dataset_, HighAbove());
  EXPECT_TRUE(world.x().isApprox(HighAbove(), 1e-9)) << "placed as asked";
  const Eigen::VectorXd torques = Eigen::VectorXd::Zero(dataset_->robot().num_dofs());
  constexpr int kSteps = 200;
  for (int step = 0; step < kSteps; ++step) world.Step(torques, 1e-3);
  const auto n = dataset_->robot().num_dofs();
  EXPECT_NEAR(world.velocity()[n + 2], -0.2 * dataset_->gravity_m_s2(), 1e-6);
  EXPECT_LT(world.velocity().head(n).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((world.x() - HighAbove()).head(n).cwiseAbs().maxCoeff(), 1e-6);
}

TEST_F(SimulatedRobot, ATorqueTurnsItsJointForward) {
  RigidBodyWorld world(*dataset_, HighAbove());
  Eigen::VectorXd torques = Eigen::VectorXd::Zero(dataset_->robot().num_dofs());
  torques[2] = 1.0;
  for (int step = 0; step < 20; ++step) world.Step(torques, 1e-3);
  EXPECT_GT(world.velocity()[2], 0.05);
  EXPECT_GT(world.x()[2], HighAbove()[2]);
}

TEST_F(SimulatedRobot, StaysUpInAMotionWithRoomToSpareAndFallsWithoutFeedback) {
  const SolutionFile file = ReadSolutions(kData + "/solutions-motion.json");
  const SolvedProblem& problem = file.problems.at(2);
  const MotionPath motion = ReadMotionPath(file.task, DefinitionOf(file, problem, *dataset_), problem.solutions.at(0),
                                           dataset_->robot().configuration_size());
  const MotionTiming timing = MotionTimer(*dataset_).Compute(motion.stances, motion.path.times, motion.path.points);
  TimedMotion timed(*dataset_, timing, motion.stances, motion.path.times, motion.path.points);
  const TrackedMotion slow = Track(*dataset_, &timed, {.slowdown = 2.0});
  EXPECT_FALSE(slow.falls) << slow.fell_at_waypoint;
  EXPECT_NEAR(slow.duration_s, 2.0 * timing.shortest_s, 1e-9);
  EXPECT_LT(slow.base_error_m, 5e-3);
  const TrackedMotion blind = Track(*dataset_, &timed, {.slowdown = 2.0, .stiffness_1_s2 = 0.0, .damping_1_s = 0.0});
  EXPECT_TRUE(blind.falls || blind.base_error_m > 2.0 * slow.base_error_m);
}

}  // namespace
}  // namespace legopt::client
