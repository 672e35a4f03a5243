// The judge on the benchmark's own robot and the reconstructed garage.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>

#include "legopt/dataset/contact.h"
#include "legopt/judge/judge.h"
#include "legopt/judge/solution_file.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kDofs = 29;

/// Moves a stance and a configuration rigidly, which preserves their relations.
void Translate(const Eigen::Vector3d& d, ProblemDefinition* problem, Eigen::VectorXd* x) {
  for (ContactTarget& target : problem->stances[0].contacts) target.position += d;
  x->segment<3>(kDofs) += d;
}

class JudgeLegOptTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!std::filesystem::exists(test::LegOptFolder() / "problemsposture.json")) return;
    dataset_ = Dataset::Load(test::LegOptFolder());
    judge_.emplace(dataset_);
  }
  static void TearDownTestSuite() {
    judge_.reset();
    dataset_.reset();
  }
  void SetUp() override {
    LEGOPT_SKIP_WITHOUT_TEST_DATA();
    const SolutionFile file = ReadSolutions(test::LegOptFolder() / "sample_solution.json");
    ASSERT_EQ(file.problems.size(), 1u);
    problem_ = file.problems[0].definition;
    sample_ = file.problems[0].solutions.at(0).waypoints.at(0);
  }
  Evaluation Evaluate(const Eigen::VectorXd& x) { return judge_->Evaluate(Task::kPosture, problem_, {&x, 1}); }

  static std::shared_ptr<const Dataset> dataset_;
  static std::optional<Judge> judge_;
  ProblemDefinition problem_;
  Eigen::VectorXd sample_;
};

std::shared_ptr<const Dataset> JudgeLegOptTest::dataset_;
std::optional<Judge> JudgeLegOptTest::judge_;

TEST_F(JudgeLegOptTest, SampleSolution) {
  EXPECT_TRUE(problem_ == dataset_->problem(Task::kPosture, 0));
  const Evaluation evaluation = Evaluate(sample_);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess);
  EXPECT_NEAR(evaluation.cost, 955.88, 0.005);
  EXPECT_LT(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 3.4e-4);
  EXPECT_GT(evaluation.Largest(Verdict::kFootPose, Rule::kLiteral), 3.0e-4);
  EXPECT_EQ(evaluation.Largest(Verdict::kCom, Rule::kLiteral), 0);
  EXPECT_LT(evaluation.Largest(Verdict::kJointLimit, Rule::kLiteral), 1e-5);
  EXPECT_EQ(evaluation.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral), 0);
  EXPECT_EQ(evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict), 0);
  EXPECT_EQ(evaluation.num_waypoints, 1);
}

TEST_F(JudgeLegOptTest, SampleSolutionsCentreOfMass) {
  Kinematics kinematics(dataset_->robot());
  kinematics.Update(sample_);
  std::vector<ContactPlacement> feet;
  for (const Contact& foot : dataset_->contacts()) {
    feet.push_back(
        {.contact = &foot, .X_WL = kinematics.link_pose(foot.link_index), .normal_W = Eigen::Vector3d::UnitZ()});
  }
  EXPECT_NEAR(SignedDistanceToPolygon(SupportPolygon(feet), kinematics.com().head<2>()), -0.088, 1e-3);
}

TEST_F(JudgeLegOptTest, BadSolutionsFailForTheNamedReason) {
  Eigen::VectorXd x = sample_;
  x[kDofs + 2] += 0.002;
  Evaluation evaluation = Evaluate(x);
  EXPECT_EQ(evaluation.literal, Verdict::kFootPose);
  EXPECT_THAT(evaluation.detail, AllOf(HasSubstr("l_foot translation z"), HasSubstr("mm")));

  x = sample_;
  x[0] = 0.6;  // the trunk twisted and bent backwards, both arms behind: feet and limits are fine, balance fails
  x[1] = -1.19;
  x[2] = 0;
  x[3] = x[11] = 1.7;
  evaluation = Evaluate(x);
  EXPECT_EQ(evaluation.literal, Verdict::kCom) << evaluation.detail;
  EXPECT_NEAR(evaluation.Largest(Verdict::kCom, Rule::kLiteral), 0.0284, 1e-4);
  EXPECT_THAT(evaluation.detail, HasSubstr("28.38 mm outside the support polygon"));

  x = sample_;
  x[5] += 0.1;  // l_arm_ely beyond 180 degrees
  evaluation = Evaluate(x);
  EXPECT_EQ(evaluation.literal, Verdict::kJointLimit);
  EXPECT_THAT(evaluation.detail, HasSubstr("l_arm_ely"));

  x = sample_;
  x[12] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Evaluate(x).literal, Verdict::kNotFinite);
  EXPECT_EQ(Evaluate(sample_.head(35)).literal, Verdict::kWrongSize);
  const std::vector<Eigen::VectorXd> two(2, sample_);
  EXPECT_EQ(judge_->Evaluate(Task::kPosture, problem_, two).literal, Verdict::kWrongWaypointCount);
}

TEST_F(JudgeLegOptTest, ElbowInAColumn) {
  // A ground-floor column: 1 x 1 m about (5, 6.25), z from 0.25 to 3.25. The posture is moved so that the left elbow
  // is inside the column's side and the body outside.
  const Eigen::Vector3d column(5, 6.25, 1.9);
  Kinematics kinematics(dataset_->robot());
  kinematics.Update(sample_);
  const Eigen::Vector3d elbow = kinematics.link_pose(dataset_->robot().FindLink("l_larm")).translation();
  const Eigen::Vector3d outwards = elbow - kinematics.link_pose(0).translation();
  Eigen::Vector3d side = column;
  const int axis = std::abs(outwards.x()) > std::abs(outwards.y()) ? 0 : 1;
  side[axis] -= std::copysign(0.5, outwards[axis]);
  ProblemDefinition problem = problem_;
  Eigen::VectorXd x = sample_;
  Translate(side - elbow, &problem, &x);
  const Evaluation evaluation = judge_->Evaluate(Task::kPosture, problem, {&x, 1});
  EXPECT_EQ(ToString(evaluation.literal), ToString(Verdict::kEnvironmentCollision)) << evaluation.detail;
  EXPECT_THAT(evaluation.detail, AllOf(HasSubstr("waypoint 0: l_"), HasSubstr("garage_reconstructed")));

  // In free air above the garage the same posture is valid.
  Translate({0, 0, 100}, &problem, &x);
  EXPECT_EQ(judge_->Evaluate(Task::kPosture, problem, {&x, 1}).literal, Verdict::kSuccess);
}

TEST_F(JudgeLegOptTest, RoundTripGivesTheSameBitsAndVerdict) {
  const test::TemporaryFolder folder;
  SolutionFile file = ReadSolutions(test::LegOptFolder() / "sample_solution.json");
  WriteSolutions(folder.path() / "out.json", file);
  const SolutionFile copy = ReadSolutions(folder.path() / "out.json");
  EXPECT_EQ(copy.problems[0].solutions[0].waypoints[0], sample_);
  EXPECT_TRUE(copy.problems[0].definition == problem_);
  EXPECT_EQ(Evaluate(copy.problems[0].solutions[0].waypoints[0]).cost, Evaluate(sample_).cost);
}

}  // namespace
}  // namespace legopt
