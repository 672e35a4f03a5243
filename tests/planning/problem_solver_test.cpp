// One job from problem to outcome: restarts, seeds, limits and statuses.

#include "legopt/planning/problem_solver.h"

#include <gtest/gtest.h>

#include <utility>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/judge/judge.h"
#include "legopt/solvers/sqp_options.h"
#include "legopt/types/input_error.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

class Solve : public ::testing::Test {
 protected:
  Solve() : folder_(temporary_.path() / "dataset"), dataset_(Dataset::Load(folder_.path())), solver_(dataset_) {}

  SolveOutcome Run(const Method& method, const SolveSettings& settings = {},
                   Initialization start = Initialization::kGood) {
    return solver_.Solve(Task::kPosture, 0, start, method, settings);
  }

  /// Returns a method that cannot succeed: one penalty value, one iteration.
  static Method FailingMethod(int multi_starts) {
    Method method;
    method.multi_starts = multi_starts;
    method.options.As<SqpOptions>().max_iterations = 1;
    method.options.As<SqpOptions>().max_penalty_iterations = 1;
    return method;
  }

  test::TemporaryFolder temporary_;
  test::SyntheticFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
  ProblemSolver solver_;
};

TEST_F(Solve, TheJudgeAcceptsWhatTheSolverCallsFeasible) {
  Judge judge(dataset_);
  for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
    const SolveOutcome outcome = Run({}, {}, start);
    EXPECT_LT(outcome.max_violation, SqpOptions().constraint_tolerance) << outcome.message;
    ASSERT_EQ(outcome.waypoints.size(), 1u);
    const Evaluation evaluation =
        judge.Evaluate(Task::kPosture, dataset_->problem(Task::kPosture, 0), outcome.waypoints);
    EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
    EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  }
}

// An arm whose optimum is inside the leg, and a reference pose in which the pair is ignored. By the original
// evaluator's list the solver does not detect the collision; with all pairs it finds a posture without it, or none.
TEST(SolveWithAllPairs, SeesThoseThatTheReferencePoseIgnores) {
  const test::TemporaryFolder temporary;
  const std::filesystem::path folder = test::SyntheticFolder(temporary.path() / "dataset").path();
  test::ReplaceInFile(folder / "robot.urdf", "lower='-0.6' upper='2'", "lower='-0.6' upper='-0.3'");  // the left ones
  test::ReplaceInFile(folder / "robot.urdf", "lower='-1' upper='1'", "lower='-0.05' upper='0.05'");
  test::ReplaceInFile(folder / "dataset.yaml", "{l_shoulder: 0,", "{l_shoulder: -0.35,");
  WriteManifestHashes(folder);
  const auto dataset = Dataset::Load(folder);
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  const auto solve = [&](PairSelection pairs) {
    Method method;
    method.pairs = pairs;
    const SolveOutcome outcome = solver.Solve(Task::kPosture, 0, Initialization::kGood, method, {});
    return std::pair(outcome.status == SolveStatus::kConvergedFeasible,
                     judge.Evaluate(Task::kPosture, dataset->problem(Task::kPosture, 0), outcome.waypoints));
  };
  const auto [blind_converged, blind] = solve(PairSelection::kReference);
  EXPECT_TRUE(blind_converged);
  EXPECT_EQ(blind.strict, Verdict::kSuccess) << blind.detail;
  EXPECT_EQ(blind.solid, Verdict::kSelfCollision);
  const auto [converged, seeing] = solve(PairSelection::kAll);
  EXPECT_EQ(converged, seeing.solid == Verdict::kSuccess) << seeing.detail;
}

TEST_F(Solve, RestartsAreUsedOnlyAfterFailure) {
  Method method;
  method.multi_starts = 10;
  EXPECT_EQ(Run(method).restarts, 0);
  const SolveOutcome hopeless = Run(FailingMethod(4));
  EXPECT_EQ(hopeless.restarts, 4);
  EXPECT_NE(hopeless.status, SolveStatus::kConvergedFeasible);
  EXPECT_FALSE(hopeless.message.empty());
  EXPECT_EQ(hopeless.waypoints.size(), 1u);  // the best point found is kept
}

TEST_F(Solve, SameSeedSameBits) {
  SolveSettings settings;
  settings.experiment_seed = 42;
  const SolveOutcome first = Run(FailingMethod(3), settings);
  Run({}, {}, Initialization::kInCollision);  // earlier solves must have no effect
  const SolveOutcome second = Run(FailingMethod(3), settings);
  EXPECT_EQ(first.waypoints[0], second.waypoints[0]);
  EXPECT_EQ(first.iterations, second.iterations);
  EXPECT_EQ(first.term_evaluations, second.term_evaluations);
  EXPECT_EQ(first.collision_queries, second.collision_queries);
  ASSERT_EQ(first.history.size(), second.history.size());
  for (size_t i = 0; i < first.history.size(); ++i) EXPECT_EQ(first.history[i].cost, second.history[i].cost);
}

TEST_F(Solve, EffortIsCounted) {
  const SolveOutcome once = Run({});
  EXPECT_EQ(once.starts, 1);
  EXPECT_GT(once.term_evaluations, once.iterations) << "several terms at each trial point";
  EXPECT_GE(once.collision_queries, once.iterations) << "each trial point is looked at";
  EXPECT_LT(once.collision_queries, once.term_evaluations) << "one term of a waypoint is that of collisions";
  const SolveOutcome hopeless = Run(FailingMethod(4));
  EXPECT_EQ(hopeless.starts, 5) << "the first attempt and its restarts";
  EXPECT_EQ(Run(Method::Of("best")).starts, 1 + Method::Of("best").options.As<BestOptions>().refinements);
}

TEST_F(Solve, SeedRepetitionAndStartChangeTheNoiseButNotTheFirstAttempt) {
  SolveSettings settings;
  const SolveOutcome base = Run(FailingMethod(1), settings);
  settings.experiment_seed = 2;
  const SolveOutcome seeded = Run(FailingMethod(1), settings);
  settings.experiment_seed = 1;
  settings.repetition = 1;
  const SolveOutcome repeated = Run(FailingMethod(1), settings);
  ASSERT_EQ(base.history.size(), 2u);
  EXPECT_EQ(base.history[0].cost, seeded.history[0].cost);
  EXPECT_NE(base.history[1].cost, seeded.history[1].cost);
  EXPECT_NE(base.history[1].cost, repeated.history[1].cost);
}

TEST_F(Solve, OptionsDoNotChangeTheNoise) {
  Method other = FailingMethod(1);
  other.continuous_weight *= 2;  // a posture has no path
  ASSERT_NE(other.Hash(), FailingMethod(1).Hash());
  const SolveOutcome a = Run(FailingMethod(1)), b = Run(other);
  ASSERT_EQ(a.history.size(), 2u);
  ASSERT_EQ(b.history.size(), 2u);
  EXPECT_EQ(a.history[1].cost, b.history[1].cost) << "of the restart";
}

TEST_F(Solve, CancelAndTimeLimit) {
  SolveSettings settings;
  settings.cancelled = [] { return true; };
  EXPECT_EQ(Run(FailingMethod(5), settings).status, SolveStatus::kCancelled);
  settings.cancelled = nullptr;
  settings.wall_limit_s = 1e-9;
  const SolveOutcome late = Run(FailingMethod(5), settings);
  EXPECT_EQ(late.status, SolveStatus::kTimeLimit);
  EXPECT_EQ(late.restarts, 0);
  EXPECT_EQ(late.waypoints.size(), 1u);
}

// The solve ends at the same point, however long it takes.
TEST_F(Solve, EffortEndsASolveAtTheSamePoint) {
  const SolveOutcome whole = Run(FailingMethod(30));
  SolveSettings settings;
  settings.effort_limit = whole.term_evaluations / 2;
  const SolveOutcome half = Run(FailingMethod(30), settings), again = Run(FailingMethod(30), settings);
  EXPECT_EQ(half.status, SolveStatus::kEffortLimit);
  EXPECT_GE(half.term_evaluations, settings.effort_limit);
  EXPECT_LT(half.term_evaluations, whole.term_evaluations);
  EXPECT_LT(half.restarts, whole.restarts);
  ASSERT_EQ(half.waypoints.size(), 1u);
  EXPECT_EQ(half.waypoints[0], again.waypoints[0]);
  EXPECT_EQ(half.term_evaluations, again.term_evaluations);
  settings.effort_limit = whole.term_evaluations + 1;
  EXPECT_EQ(Run(FailingMethod(30), settings).status, whole.status) << "a limit that is not reached changes nothing";
}

TEST_F(Solve, ProgressCountsAttempts) {
  std::vector<int> done;
  SolveSettings settings;
  settings.progress = [&](int d, int total) {
    done.push_back(d);
    EXPECT_EQ(total, 4);
  };
  Run(FailingMethod(3), settings);
  EXPECT_EQ(done, (std::vector<int>{1, 2, 3, 4}));
}

TEST_F(Solve, UnknownProblem) {
  EXPECT_THROW(solver_.Solve(Task::kPosture, 12345, Initialization::kGood, {}, {}), InputError);
}

}  // namespace
}  // namespace legopt
