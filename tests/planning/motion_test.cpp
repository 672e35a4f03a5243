// Motions: windows, their kept parts, and their judgement.

#include <gtest/gtest.h>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt {
namespace {

TEST(StanceWindows, OfAMotionSixOverlappingByOne) {
  for (int stances = 2; stances <= 499; ++stances) {
    const std::vector<StanceWindow> windows = StanceWindows(Task::kMotion, stances);
    EXPECT_EQ(static_cast<int>(windows.size()), 1 + std::max(0, (stances - 6 + 4) / 5)) << stances;
    int next = 0;
    for (const StanceWindow& window : windows) {
      EXPECT_EQ(window.first_stance, next);
      EXPECT_GE(window.num_stances, 2);
      EXPECT_LE(window.num_stances, 6);
      next = window.first_stance + window.num_stances - 1;
    }
    EXPECT_EQ(next, stances - 1);
  }
}

TEST(StanceWindows, OfAPostureItsStance) {
  const std::vector<StanceWindow> windows = StanceWindows(Task::kPosture, 1);
  ASSERT_EQ(windows.size(), 1u);
  EXPECT_EQ(windows[0].first_stance, 0);
  EXPECT_EQ(windows[0].num_stances, 1);
}

class Motion : public ::testing::Test {
 protected:
  Motion() : folder_(temporary_.path() / "dataset"), dataset_(Dataset::Load(folder_.path())), solver_(dataset_) {}

  test::TemporaryFolder temporary_;
  test::SyntheticFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
  ProblemSolver solver_;
};

/// Records the points at which solves start, and moves each free waypoint by 1 mm per solve.
class StartRecorder : public Solver {
 public:
  explicit StartRecorder(std::vector<Eigen::VectorXd>* starts) : starts_(starts) {}
  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext&) override {
    starts_->push_back(x);
    const Eigen::Index size = program.point_size(), fixed = starts_->size() > 1 ? size : 0;
    constexpr double kShift_m = 1e-3;
    for (Eigen::Index t = fixed; t < x.size(); t += size) x[t + size - 7] += kShift_m;
    SolverResult result;
    result.status = SolveStatus::kConvergedFeasible;
    result.feasible = true;
    return result;
  }

 private:
  std::vector<Eigen::VectorXd>* starts_;
};

/// Returns the points at which the windows of the dataset's first motion start.
std::vector<Eigen::VectorXd> WindowStarts(const std::shared_ptr<const Dataset>& dataset,
                                          Initialization initialization) {
  std::vector<Eigen::VectorXd> starts;
  SolverRegistry registry;
  registry.Register<SqpOptions>({.word = "recorder"}, [&](const SqpOptions&, const Sampling&) {
    return std::make_unique<StartRecorder>(&starts);
  });
  ProblemSolver solver(dataset, registry);
  const ProblemDefinition& problem = dataset->problems(Task::kMotion).front();
  solver.Solve(Task::kMotion, problem, initialization, Method::Of("recorder", registry), {});
  return starts;
}

TEST(WindowsOfRobotsWithHands, RepeatTheGuessOfTheirFirstWaypoint) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/contacts-humanoid");
  const Eigen::Index size = dataset->robot().configuration_size();
  const Stance& first = dataset->problems(Task::kMotion).front().stances.front();
  for (const Initialization initialization : {Initialization::kGood, Initialization::kInCollision}) {
    const Eigen::VectorXd guess = InitialGuess(*dataset, first, initialization);
    const std::vector<Eigen::VectorXd> starts = WindowStarts(dataset, initialization);
    ASSERT_GT(starts.size(), 1u);
    Eigen::VectorXd expected = guess;
    for (const Eigen::VectorXd& x : starts) {
      ASSERT_EQ(x.size() % size, 0);
      for (Eigen::Index t = 0; t < x.size(); t += size) EXPECT_EQ(x.segment(t, size), expected);
      expected[size - 7] += 1e-3;  // the next window begins at the solved waypoint
    }
  }
}

TEST(WindowsOfRobotsWithoutHands, StartFromTheStanceOfEachWaypoint) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/contacts-quadruped");
  const Eigen::Index size = dataset->robot().configuration_size();
  const std::vector<Stance>& stances = dataset->problems(Task::kMotion).front().stances;
  const Eigen::VectorXd x = WindowStarts(dataset, Initialization::kGood).front();
  for (int t = 0; t < x.size() / size; ++t) {
    const Stance& stance = stances[static_cast<size_t>(StanceOfWaypoint(Task::kMotion, t))];
    EXPECT_EQ(x.segment(t * size, size), InitialGuess(*dataset, stance, Initialization::kGood)) << t;
  }
}

TEST(EmbeddedMotions, WhoseEffortRunsOutKeepTheWindowsSolvedSoFar) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  ProblemSolver solver(dataset);
  SolveSettings settings;
  const auto solve = [&] {
    return solver.Solve(Task::kMotion, dataset->problems(Task::kMotion).front().id, Initialization::kGood, {},
                        settings);
  };
  const SolveOutcome whole = solve();
  ASSERT_GT(whole.windows_solved, 1) << whole.message;
  settings.effort_limit = whole.term_evaluations / 2;
  const SolveOutcome half = solve();
  EXPECT_EQ(half.status, SolveStatus::kEffortLimit);
  EXPECT_LT(half.windows_solved, whole.windows_solved);
  ASSERT_LE(half.waypoints.size(), whole.waypoints.size());
  for (std::size_t i = 0; i + 2 < half.waypoints.size(); ++i) EXPECT_EQ(half.waypoints[i], whole.waypoints[i]) << i;
}

TEST(EmbeddedMotions, AreSolvedAndJudged) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  const ProblemDefinition& problem = dataset->problems(Task::kMotion).front();
  const std::vector<StanceWindow> windows = StanceWindows(Task::kMotion, static_cast<int>(problem.stances.size()));
  SolveSettings settings;
  std::vector<std::pair<int, int>> progress, expected;
  settings.progress = [&](int done, int total) { progress.emplace_back(done, total); };
  const SolveOutcome outcome = solver.Solve(Task::kMotion, problem.id, Initialization::kGood, {}, settings);
  const auto total = static_cast<int>(windows.size());
  for (int done = 1; done <= total; ++done) expected.emplace_back(done, total);
  EXPECT_EQ(outcome.windows, total);
  EXPECT_EQ(outcome.windows_solved, total);
  EXPECT_EQ(progress, expected);
  const Evaluation evaluation = judge.Evaluate(Task::kMotion, problem, outcome.waypoints);
  EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << evaluation.detail;
  EXPECT_GE(outcome.cost, evaluation.cost * evaluation.num_waypoints - 1e-12) << "the base counts for the solver only";
}

TEST_F(Motion, AFailedWindowEndsTheProblemAndSaysWhich) {
  Method method;
  method.multi_starts = 2;
  method.options.As<SqpOptions>().max_iterations = 1;
  method.options.As<SqpOptions>().max_penalty_iterations = 1;
  const SolveOutcome outcome = solver_.Solve(Task::kMotion, 0, Initialization::kInCollision, method, {});
  EXPECT_EQ(outcome.windows_solved, 0);
  EXPECT_EQ(outcome.restarts, 2);
  EXPECT_TRUE(outcome.waypoints.empty());
  EXPECT_NE(outcome.status, SolveStatus::kConvergedFeasible);
  EXPECT_NE(outcome.message.find("window 0 of 1 (stances 0 to 2)"), std::string::npos) << outcome.message;
}

// Long enough for several windows, short enough for daily tests.
constexpr size_t kMaxStances = 40;

TEST(LegOptMotions, PlainSqpSolvesTheShortOnes) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  ProblemSolver solver(dataset);
  Judge judge(dataset);
  int tried = 0;
  for (const ProblemDefinition& problem : dataset->problems(Task::kMotion)) {
    if (problem.stances.size() > kMaxStances) continue;
    for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
      const SolveOutcome outcome = solver.Solve(Task::kMotion, problem.id, start, {}, {});
      const Evaluation evaluation = judge.Evaluate(Task::kMotion, problem, outcome.waypoints);
      EXPECT_EQ(evaluation.strict, Verdict::kSuccess) << problem.id << " " << outcome.message << evaluation.detail;
      const std::vector<StanceWindow> windows = StanceWindows(Task::kMotion, static_cast<int>(problem.stances.size()));
      EXPECT_GT(windows.size(), 3u);
      EXPECT_EQ(outcome.windows_solved, static_cast<int>(windows.size()));
      ++tried;
    }
  }
  EXPECT_GT(tried, 0);
}

TEST(LegOptMotions, LaterWindowsLeaveTheirFirstWaypointAlone) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const auto dataset = Dataset::Load(test::LegOptFolder());
  ProblemSolver solver(dataset);
  SolveSettings stop_after_one;
  int windows_done = 0;
  stop_after_one.progress = [&](int done, int) { windows_done = done; };
  const ProblemDefinition* problem = nullptr;
  for (const ProblemDefinition& one : dataset->problems(Task::kMotion)) {
    if (one.stances.size() <= kMaxStances) problem = &one;
  }
  ASSERT_NE(problem, nullptr);
  stop_after_one.cancelled = [&] { return windows_done >= 1; };
  const SolveOutcome part = solver.Solve(Task::kMotion, problem->id, Initialization::kGood, {}, stop_after_one);
  EXPECT_EQ(part.status, SolveStatus::kCancelled);
  EXPECT_EQ(part.windows_solved, 1);
  ASSERT_EQ(part.waypoints.size(), 12u);
  const SolveOutcome whole = solver.Solve(Task::kMotion, problem->id, Initialization::kGood, {}, {});
  ASSERT_EQ(whole.waypoints.size(), 2 * problem->stances.size());
  for (size_t w = 0; w <= 10; ++w) EXPECT_EQ(whole.waypoints[w], part.waypoints[w]) << w;
  EXPECT_NE(whole.waypoints[11], part.waypoints[11]) << "re-planned";
}

}  // namespace
}  // namespace legopt
