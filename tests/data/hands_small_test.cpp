// Policy: palms and rails are judged on the embedded dataset hands-small, with postures that LegOpt-best finds there.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;
using ::testing::HasSubstr;

Contact Hand(ContactKind kind) {
  ContactDescription description;
  description.kind = kind;
  description.position = {0.1, 0.2, 0.3};
  description.rpy_rad = {0.4, -0.5, 0.6};
  description.points = {Vector3d(0.03, 0, 0), Vector3d(-0.03, 0, 0)};
  description.slide_m = 0.1;
  return ResolveContact(description, 0, {Vector3d(-1, -1, -1), Vector3d(1, 1, 1)});
}

const ContactTarget kTarget{.contact = "",
                            .position = {1, 2, 3},
                            .rotation = Eigen::Quaterniond(AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()))};

/// Pose error after a motion of the contact frame in its own axes.
ContactPoseError ErrorAfter(const Contact& contact, const Eigen::Isometry3d& motion) {
  const Eigen::Isometry3d X_WC = contact.LinkTarget(kTarget) * contact.X_LC * motion;
  return ComputeContactPoseError(contact, kTarget, X_WC * contact.X_LC.inverse());
}

Eigen::Isometry3d Turn(double angle_rad, const Vector3d& axis) {
  return Eigen::Isometry3d(AngleAxisd(angle_rad, axis));
}
Eigen::Isometry3d Shift(double x, double y, double z) { return Eigen::Isometry3d(Eigen::Translation3d(x, y, z)); }

TEST(HandPose, APalmMayTurnAboutTheNormalOnly) {
  const Contact palm = Hand(ContactKind::kPalm);
  EXPECT_LT(ErrorAfter(palm, Turn(2.5, Vector3d::UnitZ())).violation, 1e-12);
  const ContactPoseError tilted = ErrorAfter(palm, Turn(0.3, Vector3d::UnitY()));
  EXPECT_NEAR(tilted.violation, std::sin(0.15), 1e-12);
  EXPECT_EQ(tilted.component, 1);
  EXPECT_GT(ErrorAfter(palm, Turn(3.1, Vector3d::UnitX())).violation, 0.9) << "the back of the hand is no palm";
  EXPECT_NEAR(ErrorAfter(palm, Shift(0.02, 0, 0)).violation, 0.02, 1e-12);
}

TEST(HandPose, AGripMayTurnAndSlideOnItsBar) {
  const Contact grip = Hand(ContactKind::kRail);
  EXPECT_LT(ErrorAfter(grip, Turn(-2.0, Vector3d::UnitX())).violation, 1e-12);
  EXPECT_LT(ErrorAfter(grip, Shift(0.09, 0, 0)).violation, 1e-12);
  EXPECT_NEAR(ErrorAfter(grip, Shift(-0.13, 0, 0)).violation, 0.03, 1e-12) << "beyond the stretch of 0.1 m";
  EXPECT_NEAR(ErrorAfter(grip, Shift(0, 0.01, 0)).violation, 0.01, 1e-12);
  EXPECT_NEAR(ErrorAfter(grip, Turn(0.2, Vector3d::UnitZ())).violation, std::sin(0.1), 1e-12);
}

/// The embedded dataset hands-small, with changes.
class HandsSmall : public testing::Test {
 protected:
  HandsSmall() {
    std::filesystem::copy(SourceFolder() + "/data/hands-small", folder_.path(),
                          std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
  }

  void Load() {
    WriteManifestHashes(folder_.path());
    dataset_ = Dataset::Load(folder_.path());
  }
  /// Solves a problem under effort limits.
  Eigen::VectorXd Solve(int id) const {
    Method method = Method::Of("best");
    method.physics = Physics::kEffort;
    const SolveOutcome outcome =
        ProblemSolver(dataset_).Solve(Task::kPosture, id, Initialization::kGood, method, SolveSettings{});
    EXPECT_EQ(outcome.waypoints.size(), 1u);
    return outcome.waypoints.at(0);
  }
  Evaluation Evaluate(int id, const Eigen::VectorXd& x) const {
    return Judge(dataset_).Evaluate(Task::kPosture, dataset_->problem(Task::kPosture, id), {&x, 1});
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
};

TEST_F(HandsSmall, EveryProblemHasAPostureByTheStrictestRule) {
  Load();
  for (int id = 0; id < 3; ++id) {
    const Evaluation evaluation = Evaluate(id, Solve(id));
    EXPECT_EQ(evaluation.physical, Verdict::kSuccess) << id << ": " << evaluation.detail;
    EXPECT_EQ(evaluation.Largest(Verdict::kEquilibrium, Rule::kLiteral), 0.0);
    EXPECT_TRUE(std::isnan(evaluation.Largest(Verdict::kCom, Rule::kLiteral))) << "equilibrium replaces it";
  }
}

TEST_F(HandsSmall, HandsThatOnlyTouchDoNotHoldTheRobot) {
  Load();
  ProblemDefinition problem = dataset_->problem(Task::kPosture, 0);
  for (ContactTarget& target : problem.stances[0].contacts) target.carries = target.contact.ends_with("foot");
  // Without physics, the centre of mass is above the feet, whatever their slope.
  const SolveOutcome outcome = ProblemSolver(dataset_).Solve(Task::kPosture, problem, Initialization::kGood,
                                                             Method::Of("best"), SolveSettings{});
  ASSERT_EQ(outcome.waypoints.size(), 1u);
  const Eigen::VectorXd& x = outcome.waypoints.front();
  const Evaluation evaluation = Judge(dataset_).Evaluate(Task::kPosture, problem, {&x, 1});
  EXPECT_EQ(evaluation.physical, Verdict::kEquilibrium);
  EXPECT_THAT(evaluation.detail, HasSubstr("in any posture: the robot slides along"));
}

TEST_F(HandsSmall, AGripNeedsABar) {
  Load();
  const Eigen::VectorXd x = Solve(1);
  test::ReplaceInFile(folder_.path() / "scene.yaml", "position: [4.35, 0, 1.3]", "position: [4.35, 0, 1.304]");
  Load();
  Evaluation evaluation = Evaluate(1, x);
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.solid, Verdict::kTouch);
  EXPECT_THAT(evaluation.detail, HasSubstr("grips no bar of the scene"));
  EXPECT_NEAR(evaluation.Largest(Verdict::kTouch, Rule::kSolid), 0.004, 2e-4);
}

TEST_F(HandsSmall, APushThatIsTooLargeIsNotResisted) {
  Load();
  const Eigen::VectorXd x = Solve(2);
  ProblemDefinition problem = dataset_->problem(Task::kPosture, 2);
  problem.stances[0].push_N = 5'000.0;
  const Evaluation evaluation = Judge(dataset_).Evaluate(Task::kPosture, problem, {&x, 1});
  EXPECT_EQ(evaluation.solid, Verdict::kSuccess);
  EXPECT_EQ(evaluation.physical, Verdict::kPush);
  EXPECT_THAT(evaluation.detail, HasSubstr("and must resist 5000 N (tolerance 1 N)"));
  const double missing_N = evaluation.Largest(Verdict::kPush, Rule::kPhysical);
  problem.stances[0].push_N = 5'000.0 - missing_N;
  EXPECT_EQ(Judge(dataset_).Evaluate(Task::kPosture, problem, {&x, 1}).physical, Verdict::kSuccess);
}

}  // namespace
}  // namespace legopt
