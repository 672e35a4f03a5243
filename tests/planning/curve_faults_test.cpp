// Policy: the spline through the points of a motion is checked piece by piece, and stays near the straight pieces where
// points are added.
#include "legopt/planning/internal/curve_faults.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/temporary_folder.h"

namespace legopt {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Three waypoints of a standing robot. An arm reaches its limit at the second one and stays there.
class ArmAtLimit : public ::testing::Test {
 protected:
  ArmAtLimit() {
    const Eigen::VectorXd at_limit = Arm(limit_);
    path_ = MakePath(std::vector{Arm(limit_ - 0.3), at_limit, at_limit},
                     std::vector<std::vector<Eigen::VectorXd>>{{Arm(limit_ - 0.15)}, {at_limit}});
  }

  Eigen::VectorXd Arm(double angle) const {
    Eigen::VectorXd x = test::StandingUpright();
    x[test::kRightShoulder] = angle;
    return x;
  }

  std::vector<CurveFault> Faults() {
    const Stance& stance = dataset_->problem(Task::kPosture, 0).stances[0];
    return FindCurveFaults(dataset_->robot(), paths_, path_, std::vector<const Stance*>(3, &stance));
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  CollisionQuery query_{dataset_->collision_model(SceneRepresentation::kSolid, PairSelection::kReference)};
  std::unique_ptr<Solver> solver_ = MakeSolver(Method::Of("best"));
  PathSolver paths_{*dataset_, query_, *solver_, Task::kTimed, {}};
  double limit_ = dataset_->robot().upper_limits()[test::kRightShoulder];
  TimedPath path_;
};

TEST_F(ArmAtLimit, OvershootBetweenPointsIsFound) {
  const std::vector<CurveFault> faults = Faults();
  ASSERT_FALSE(faults.empty());
  EXPECT_EQ(faults.front().piece, 2u);  // the piece after the second waypoint
  EXPECT_EQ(faults.front().segment, 1u);
  EXPECT_THAT(faults.front().message, HasSubstr("r_shoulder exceeds its limit"));
}

TEST_F(ArmAtLimit, PointsOnFaultyPiecesEndTheOvershoot) {
  std::size_t inserted = 0;
  for (std::vector<CurveFault> faults = Faults(); !faults.empty() && inserted < 20; faults = Faults()) {
    const std::size_t i = faults.back().piece;
    const Eigen::VectorXd middle = 0.5 * (path_.points[i] + path_.points[i + 1]);
    InsertPoints(i, std::vector{middle}, &path_);
    ++inserted;
  }
  EXPECT_TRUE(Faults().empty());
  EXPECT_LT(inserted, 20u);
}

TEST_F(ArmAtLimit, InsertedPointsDivideAPieceEqually) {
  InsertPoints(1, std::vector{Arm(0.1), Arm(0.2), Arm(0.3)}, &path_);
  EXPECT_THAT(path_.times, ElementsAre(0.0, 0.5, 0.625, 0.75, 0.875, 1.0, 1.5, 2.0));
  EXPECT_THAT(path_.waypoints, ElementsAre(0u, 5u, 7u));
  EXPECT_EQ(path_.points[3], Arm(0.2));
  EXPECT_EQ(path_.points[5], Arm(limit_));
}

}  // namespace
}  // namespace legopt
