// Policy: paths between waypoints satisfy the judge from end to end, and paths that the solver calls free are free at
// every finer resolution.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "legopt/judge/internal/path_examiner.h"
#include "legopt/judge/judge.h"
#include "legopt/planning/internal/path_solver.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/robot/configuration.h"
#include "legopt/solvers/methods/method.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

using ::testing::HasSubstr;

constexpr double kRange_m = 0.05;

class PathClearanceTest : public ::testing::Test {
 protected:
  /// Returns the smallest distance on the path, by many samples.
  double Nearest_m(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
    constexpr int kSamples = 4000;
    Eigen::VectorXd x(from.size());
    double nearest_m = kRange_m;
    for (int k = 0; k <= kSamples; ++k) {
      InterpolateConfiguration(from, to, k / static_cast<double>(kSamples), x);
      kinematics_.UpdatePoses(x);
      for (const ProximityPair& contact : query_.Contacts(kinematics_, kRange_m)) {
        nearest_m = std::min(nearest_m, contact.distance_m);
      }
    }
    return nearest_m;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  CollisionQuery query_{dataset_->collision_model(SceneRepresentation::kSolid, PairSelection::kReference)};
  PathClearance clearance_{dataset_->robot(), query_, kRange_m};
  Kinematics kinematics_{dataset_->robot()};
};

TEST_F(PathClearanceTest, AgreesWithManySamples) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> arm(-0.5, 1.5), shift(-0.3, 1.4);
  int free = 0, blocked = 0;
  for (int i = 0; i < 200; ++i) {
    Eigen::VectorXd from = test::StandingUpright(), to = from;
    from[test::kLeftShoulder] = arm(generator);
    to[test::kLeftShoulder] = arm(generator);
    to[test::kBaseY] += shift(generator);
    from[test::kBaseX] += shift(generator);
    const bool is_free = clearance_.IsFree(from, to);
    const double nearest_m = Nearest_m(from, to);
    (is_free ? free : blocked) += 1;
    if (is_free) {
      EXPECT_GT(nearest_m, 0.0) << i;
    } else {
      EXPECT_LT(nearest_m, PathClearance::kClearance_m + 1e-5) << i;
      EXPECT_LT(clearance_.obstacle().distance_m, PathClearance::kClearance_m) << i;
    }
  }
  EXPECT_GT(free, 20);
  EXPECT_GT(blocked, 20);
}

TEST_F(PathClearanceTest, SeesBothEndsAndASwiftTurn) {
  const Eigen::VectorXd up = test::StandingUpright();
  Eigen::VectorXd in_column = up;
  in_column[test::kLeftShoulder] = 1.2;
  EXPECT_TRUE(clearance_.IsFree(up, up));
  EXPECT_FALSE(clearance_.IsFree(up, in_column));
  EXPECT_FALSE(clearance_.IsFree(in_column, up));
  EXPECT_FALSE(clearance_.IsFree(in_column, in_column));
  Eigen::VectorXd turned = up;  // the arms move through the column during half a rotation of the base
  turned[test::kLeftShoulder] = up[test::kLeftShoulder];
  Eigen::VectorXd raised = up;
  raised[test::kLeftShoulder] = raised[test::kRightShoulder] = 1.2;
  raised[test::kBaseY] = -0.3;
  turned = raised;
  turned.tail<4>() << 0, 0, 0, 1;
  EXPECT_EQ(clearance_.IsFree(raised, turned), Nearest_m(raised, turned) > PathClearance::kClearance_m);
}

struct Solved {
  SolveOutcome outcome;
  Evaluation evaluation;
};

class EmbeddedPaths : public ::testing::Test {
 protected:
  Solved Solve(Task task, Initialization start, const Method& method = {}, const SolveSettings& settings = {}) {
    const ProblemDefinition& problem = dataset_->problems(task).front();
    Solved solved{.outcome = solver_.Solve(task, problem.id, start, method, settings), .evaluation = {}};
    solved.evaluation = judge_.Evaluate(task, problem, solved.outcome.waypoints);
    return solved;
  }

  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(SourceFolder() + "/data/garage-small");
  ProblemSolver solver_{dataset_};
  Judge judge_{dataset_};
};

TEST_F(EmbeddedPaths, AreSolvedAndJudged) {
  for (const Task task : {Task::kContinuous, Task::kBalanced}) {
    for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
      const auto [outcome, evaluation] = Solve(task, start);
      EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << ToString(task) << " " << outcome.message << evaluation.detail;
      EXPECT_EQ(evaluation.interpolation.free_share, 1);
      EXPECT_GT(std::ssize(outcome.waypoints), evaluation.num_waypoints);
      EXPECT_EQ(outcome.status, SolveStatus::kConvergedFeasible) << outcome.message;
    }
  }
}

// Whether a motion can be executed is not part of the solver's own rules yet, but the curve must keep all others.
TEST_F(EmbeddedPaths, CurvesOfTimedMotionsKeepTheRules) {
  for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
    const auto [outcome, evaluation] = Solve(Task::kTimed, start);
    EXPECT_EQ(outcome.status, SolveStatus::kConvergedFeasible) << outcome.message;
    EXPECT_TRUE(evaluation.timing) << evaluation.detail;  // computed only after all other rules
    EXPECT_TRUE(evaluation.literal == Verdict::kSuccess || evaluation.literal == Verdict::kTiming);
    TimedPath path;
    ASSERT_FALSE(ParsePath(outcome.waypoints, evaluation.num_waypoints, dataset_->robot().configuration_size(), &path));
    EXPECT_GE(path.points.size(), 4 * (path.waypoints.size() - 1) + 1);
  }
}

// The end points are fixed: continuity only adds points between the waypoints.
TEST_F(EmbeddedPaths, KeepTheWaypointsOfTheMotion) {
  const SolveOutcome motion = Solve(Task::kMotion, Initialization::kGood).outcome;
  const auto [outcome, evaluation] = Solve(Task::kContinuous, Initialization::kGood);
  TimedPath path;
  ASSERT_FALSE(ParsePath(outcome.waypoints, evaluation.num_waypoints, dataset_->robot().configuration_size(), &path));
  ASSERT_EQ(path.waypoints.size(), motion.waypoints.size());
  for (std::size_t w = 0; w < path.waypoints.size(); ++w) {
    EXPECT_EQ(path.points[path.waypoints[w]], motion.waypoints[w]) << w;
  }
  EXPECT_GT(outcome.term_evaluations, motion.term_evaluations);
}

TEST_F(EmbeddedPaths, AreTheSameBitsAgain) {
  const Solved a = Solve(Task::kBalanced, Initialization::kInCollision);
  const Solved b = Solve(Task::kBalanced, Initialization::kInCollision);
  EXPECT_EQ(a.outcome.waypoints, b.outcome.waypoints);
  EXPECT_EQ(a.outcome.term_evaluations, b.outcome.term_evaluations);
}

// A motion whose effort limit is reached between its waypoints reports that status, for any segment.
TEST_F(EmbeddedPaths, EffortLimitIsReported) {
  const std::int64_t motion = Solve(Task::kMotion, Initialization::kGood).outcome.term_evaluations;
  const std::int64_t whole = Solve(Task::kContinuous, Initialization::kGood).outcome.term_evaluations;
  ASSERT_GT(whole, motion + 2);
  for (const std::int64_t limit : {motion, motion + 1, (motion + whole) / 2}) {
    SolveSettings settings;
    settings.effort_limit = limit;
    const auto [outcome, evaluation] = Solve(Task::kContinuous, Initialization::kGood, {}, settings);
    EXPECT_EQ(outcome.status, SolveStatus::kEffortLimit) << limit << " of " << whole;
  }
}

// Also while points are added for the sake of the spline.
TEST_F(EmbeddedPaths, EffortLimitIsReportedForCurves) {
  const std::int64_t straight = Solve(Task::kBalanced, Initialization::kGood).outcome.term_evaluations;
  const std::int64_t whole = Solve(Task::kTimed, Initialization::kGood).outcome.term_evaluations;
  for (const int part : {1, 2, 3}) {
    SolveSettings settings;
    settings.effort_limit = straight / 2 + (whole - straight / 2) * part / 4;
    const auto [outcome, evaluation] = Solve(Task::kTimed, Initialization::kGood, {}, settings);
    EXPECT_EQ(outcome.status, SolveStatus::kEffortLimit) << part;
  }
}

// The robot is not balanced during a jump.
TEST(PathSolver, FailedSegmentIsNamed) {
  const test::TemporaryFolder folder;
  const auto dataset = Dataset::Load(test::SyntheticFolder(folder.path()).path());
  ProblemSolver solver(dataset);
  ProblemDefinition jump{.id = 1, .stances = {2, dataset->problem(Task::kPosture, 0).stances[0]}};
  for (ContactTarget& target : jump.stances[1].contacts) target.position.x() += 0.01;
  Judge judge(dataset);
  const SolveOutcome leapt = solver.Solve(Task::kContinuous, jump, Initialization::kGood, {}, {});
  EXPECT_EQ(judge.Evaluate(Task::kContinuous, jump, leapt.waypoints).literal, Verdict::kSuccess) << leapt.message;
  const SolveOutcome outcome = solver.Solve(Task::kBalanced, jump, Initialization::kGood, {}, {});
  EXPECT_EQ(judge.Evaluate(Task::kBalanced, jump, outcome.waypoints).literal, Verdict::kCom);
  EXPECT_EQ(outcome.status, SolveStatus::kConvergedInfeasible);
  EXPECT_THAT(outcome.message, HasSubstr("from waypoint 1 to the next"));
}

/// A posture, and one whose arm is as deep in the column as possible.
class ColumnOnPath : public ::testing::Test {
 protected:
  ColumnOnPath() : up_(ProblemSolver(dataset_).Solve(Task::kPosture, 0, Initialization::kGood, {}, {}).waypoints[0]) {
    in_column_ = up_;
    Kinematics kinematics(dataset_->robot());
    double deepest_m = 0.0;
    for (double angle = -1.5; angle <= 1.5; angle += 0.05) {
      Eigen::VectorXd x = up_;
      x[test::kLeftShoulder] = angle;
      kinematics.UpdatePoses(x);
      for (const ProximityPair& contact : query_.Contacts(kinematics, kRange_m)) {
        if (contact.distance_m >= deepest_m) continue;
        deepest_m = contact.distance_m;
        in_column_ = x;
      }
    }
    EXPECT_LT(deepest_m, -0.01);
  }

  PathSolution Solve(const std::vector<Eigen::VectorXd>& waypoints, PathEnds ends = {}) {
    WaypointPath waypoint_path;
    waypoint_path.stances.assign(waypoints.size(), &dataset_->problem(Task::kPosture, 0).stances[0]);
    waypoint_path.waypoints = waypoints;
    waypoint_path.ways.resize(waypoints.size() - 1);
    waypoint_path.ends = ends;
    return paths_.Solve(waypoint_path, [] {
      MultiStartSettings settings;
      settings.generator = [](int restart) { return std::mt19937_64(static_cast<unsigned>(restart)); };
      return settings;
    });
  }

  void ExpectLegal(const PathSolution& solution) {
    ASSERT_TRUE(solution.feasible) << solution.message;
    const ProblemDefinition problem{.id = 1, .stances = {2, dataset_->problem(Task::kPosture, 0).stances[0]}};
    const TimedPath path = MakePath(solution.waypoint_path.waypoints, solution.waypoint_path.ways);
    const Evaluation evaluation = Judge(dataset_).Evaluate(Task::kContinuous, problem, FormatPath(path));
    EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<const Dataset> dataset_ = Dataset::Load(test::SyntheticFolder(folder_.path()).path());
  CollisionQuery query_{dataset_->collision_model(SceneRepresentation::kSolid, PairSelection::kReference)};
  std::unique_ptr<Solver> solver_ = MakeSolver(Method::Of("best"));
  PathSolver paths_{*dataset_, query_, *solver_, Task::kContinuous, {}};
  Eigen::VectorXd up_, in_column_;
};

TEST_F(ColumnOnPath, NoPathEntersTheColumn) {
  const PathSolution segment = Solve({up_, in_column_});
  EXPECT_FALSE(segment.feasible);
  EXPECT_THAT(segment.message, HasSubstr("collision"));
  EXPECT_EQ(segment.waypoint_path.waypoints[1], in_column_);
}

// The motion does not have to go there.
TEST_F(ColumnOnPath, WaypointsInItAreMoved) {
  const PathSolution solution = Solve({up_, in_column_, in_column_, up_});
  ExpectLegal(solution);
  EXPECT_EQ(solution.waypoint_path.waypoints.front(), up_);
  EXPECT_EQ(solution.waypoint_path.waypoints.back(), up_);
}

TEST_F(ColumnOnPath, WhereTheMotionEndsNothingHoldsTheWaypoint) {
  ExpectLegal(Solve({in_column_, up_, up_, in_column_}, {true, true}));
  EXPECT_FALSE(Solve({in_column_, up_, up_, in_column_}, {true, false}).feasible);
  EXPECT_FALSE(Solve({in_column_, up_, up_, in_column_}, {false, true}).feasible);
}

// If nothing has to move, no points are added.
TEST(PathSolver, ValidStraightPathIsKept) {
  const test::TemporaryFolder folder;
  const auto dataset = Dataset::Load(test::SyntheticFolder(folder.path()).path());
  ProblemSolver solver(dataset);
  const ProblemDefinition& posture = dataset->problem(Task::kPosture, 0);
  const ProblemDefinition problem{.id = 1, .stances = {posture.stances[0], posture.stances[0]}};
  const SolveOutcome outcome = solver.Solve(Task::kContinuous, problem, Initialization::kGood, {}, {});
  Judge judge(dataset);
  const Evaluation evaluation = judge.Evaluate(Task::kContinuous, problem, outcome.waypoints);
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail << outcome.message;
  EXPECT_EQ(outcome.waypoints.size(), 4u);
}

// Long enough for several windows, short enough for daily tests.
constexpr size_t kMostStances = 40;

TEST(LegOptPaths, TheShortMotionsAreContinuousAndBalanced) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  Method method;
  method.pairs = PairSelection::kReference;  // with all pairs, SQP fails in the first window of balanced motion 33
  int tried = 0;
  for (const ProblemDefinition& problem : dataset->problems(Task::kMotion)) {
    if (problem.stances.size() > kMostStances) continue;
    for (const Task task : {Task::kContinuous, Task::kBalanced}) {
      const SolveOutcome outcome = solver.Solve(task, problem.id, Initialization::kGood, method, {});
      const Evaluation evaluation = judge.Evaluate(task, problem, outcome.waypoints);
      EXPECT_EQ(evaluation.strict, Verdict::kSuccess)
          << problem.id << " " << ToString(task) << " " << outcome.message << evaluation.detail;
      ++tried;
    }
  }
  EXPECT_GT(tried, 0);
}

}  // namespace
}  // namespace legopt
