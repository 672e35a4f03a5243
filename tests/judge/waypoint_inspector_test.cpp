// Policy: listed findings have the judge's own figures. The largest value of a list equals the evaluation's, and a
// pair is listed as a collision by a rule exactly if it fails a verdict by that rule.
#include "legopt/judge/internal/waypoint_inspector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "legopt/judge/judge.h"
#include "legopt/problem/terms/initial_guess.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/temporary_folder.h"

namespace legopt {
namespace {

class FindingsTest : public testing::Test {
 protected:
  // Returns the verdict by a rule that follows from the lists, for collisions only.
  static bool Collides(const WaypointDiagnostics& findings, Rule rule) {
    return std::ranges::any_of(
        findings.overlaps, [&](const OverlapDiagnostic& finding) { return finding.fails && *finding.fails <= rule; });
  }

  void ExpectTheJudgesFigures(const Eigen::VectorXd& x) {
    const Evaluation evaluation = judge_.Evaluate(Task::kPosture, posture_, {&x, 1});
    const WaypointDiagnostics findings = lister_.At(posture_.stances[0], x);
    double foot = 0, limit = 0, environment = 0, self = 0, solid = 0;
    for (const FootDiagnostic& f : findings.feet) foot = std::max(foot, f.violation);
    for (const LimitDiagnostic& f : findings.limits) limit = std::max(limit, f.excess);
    for (const OverlapDiagnostic& f : findings.overlaps) {
      const ExactCollision::Overlap& overlap = f.overlap;
      if (overlap.other_link < 0) environment = std::max(environment, overlap.literal_m);
      if (overlap.other_link >= 0 && !overlap.ignored) self = std::max(self, overlap.depth_m);
      solid = std::max({solid, overlap.depth_m, overlap.inside_m});
    }
    EXPECT_EQ(foot, evaluation.Largest(Verdict::kFootPose, Rule::kLiteral));
    EXPECT_EQ(limit, evaluation.Largest(Verdict::kJointLimit, Rule::kLiteral));
    EXPECT_EQ(std::max(0.0, findings.com_m), evaluation.Largest(Verdict::kCom, Rule::kLiteral));
    if (std::isnan(evaluation.SolidDepth_m())) return;  // phase B was not reached
    ++compared_;
    EXPECT_EQ(environment, evaluation.Largest(Verdict::kEnvironmentCollision, Rule::kLiteral));
    EXPECT_EQ(self, evaluation.Largest(Verdict::kSelfCollision, Rule::kStrict));
    EXPECT_EQ(solid, evaluation.SolidDepth_m());
    for (const auto& rule : kEnumNames<Rule>) {
      EXPECT_EQ(Collides(findings, rule.value), evaluation.by(rule.value) != Verdict::kSuccess) << rule.word;
    }
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  Judge judge_{dataset_};
  WaypointInspector lister_{dataset_};
  ProblemDefinition posture_ = dataset_->problem(Task::kPosture, 0);
  int compared_ = 0;
};

TEST_F(FindingsTest, LargestOfEachListIsTheEvaluationsFigure) {
  std::mt19937_64 generator(1);
  ExpectTheJudgesFigures(test::StandingUpright());
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd x = test::StandingUpright();
    std::uniform_real_distribution<double> left(-0.5, 1.3), right(-0.4, 0.4), shift(-0.05, 0.05);
    // Moving only the arms leaves the feet on their targets, so collisions are evaluated.
    x[test::kLeftShoulder] = left(generator);
    x[test::kRightShoulder] = right(generator);
    if (i % 8 == 0) x[test::kBaseX] += shift(generator);
    ExpectTheJudgesFigures(x);
  }
  EXPECT_GT(compared_, 20);
}

TEST_F(FindingsTest, WitnessPointsAreAsFarApartAsThePairIsDeep) {
  int seen = 0, same = 0;
  for (double angle = -3.0; angle <= 3.0; angle += 0.004) {
    Eigen::VectorXd x = test::StandingUpright();
    x[test::kLeftShoulder] = angle;
    x[test::kBaseX] += 0.1 * angle;
    for (const OverlapDiagnostic& finding : lister_.At(posture_.stances[0], x).overlaps) {
      const ExactCollision::Overlap& overlap = finding.overlap;
      if (!overlap.point_W.allFinite()) continue;
      ++seen;
      constexpr double kMergedContacts_m = 2e-5;  // exact_collision.h: ODE merges contacts of one cell
      const double apart_m = (overlap.point_W - overlap.other_point_W).norm();
      EXPECT_GT(apart_m, overlap.depth_m - kMergedContacts_m) << "no crossing of ODE's is missed";
      same += apart_m < overlap.depth_m + kMergedContacts_m ? 1 : 0;
    }
  }
  // In the other cases one more pair of triangles crosses in double precision than in ODE's single precision.
  EXPECT_GT(seen, 100);
  EXPECT_GT(same, seen * 9 / 10) << "of " << seen;
}

TEST_F(FindingsTest, ListsNothingOfWhatIsNoConfiguration) {
  Eigen::VectorXd x = test::StandingUpright();
  x[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(lister_.At(posture_.stances[0], x).feet.empty());
  EXPECT_TRUE(lister_.At(posture_.stances[0], Eigen::VectorXd::Zero(3)).feet.empty());
}

TEST_F(FindingsTest, BetweenWaypointsAreTheInterpolationsDepths) {
  Eigen::VectorXd from = test::StandingUpright(), to = from;
  to[test::kLeftShoulder] = 2.0;
  const std::vector<Eigen::VectorXd> waypoints = {from, to};
  Kinematics kinematics(dataset_->robot());
  ExactCollision collision(dataset_->robot(), dataset_->scene(), dataset_->collision_model());
  const InterpolationScore score = ScoreInterpolation(waypoints, kinematics, collision);
  double environment = 0, self = 0;
  for (int k = 1; k <= kInterpolationSteps; ++k) {
    for (const OverlapDiagnostic& f :
         lister_.TransitionRule(from, to, static_cast<double>(k) / (kInterpolationSteps + 1))) {
      double& deepest = f.overlap.other_link < 0 ? environment : self;
      if (!f.overlap.ignored) deepest = std::max(deepest, f.overlap.depth_m);
    }
  }
  EXPECT_EQ(environment, score.environment_depth_m);
  EXPECT_EQ(self, score.self_depth_m);
}

}  // namespace
}  // namespace legopt
