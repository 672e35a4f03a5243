// Windows without a solution are solved again together with earlier stances, if the method's solver asks for it.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <vector>

#include "legopt/planning/problem_solver.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

/// Answers of a scripted solver, and a record of the programs that it was given.
struct Script {
  std::function<SolverResult(int call)> answer;
  int max_backtracks = 0;
  std::vector<int> num_waypoints = {};  ///< length of each program, in order of the calls
  int cancelled_at = -1;                ///< call that is cancelled
};

/// Moves no waypoint, and answers by a script.
class ScriptedSolver : public Solver {
 public:
  explicit ScriptedSolver(Script& script) : script_(&script) {}

  SolverResult Solve(Program& program, Eigen::VectorXd& /*x*/, const SolverContext& context) override {
    SolverResult result = script_->answer(static_cast<int>(script_->num_waypoints.size()));
    script_->num_waypoints.push_back(program.num_waypoints());
    result.status = result.feasible ? SolveStatus::kConvergedFeasible : SolveStatus::kConvergedInfeasible;
    if (script_->cancelled_at == static_cast<int>(script_->num_waypoints.size()) - 1) {
      result.status = SolveStatus::kCancelled;
    }
    context.Record({.cost = result.value.cost, .violation = result.value.max_violation, .accepted = true});
    return result;
  }
  int max_backtracks() const override { return script_->max_backtracks; }

 private:
  Script* script_;
};

struct NoOptions {
  static void Visit(auto& /*options*/, auto& /*fields*/) {}
};

class WindowBacktrack : public ::testing::Test {
 protected:
  WindowBacktrack() : folder_(temporary_.path() / "dataset"), dataset_(Dataset::Load(folder_.path())) {}

  /// Solves a motion of 16 stances: windows of the stances 0 to 5, 5 to 10 and 10 to 15.
  SolveOutcome Run(Script& script) {
    SolverRegistry registry;
    registry.Register<NoOptions>({.word = "scripted"}, [&](const NoOptions&, const Sampling&) {
      return std::make_unique<ScriptedSolver>(script);
    });
    const Method method = Method::Of("scripted", registry);
    ProblemDefinition problem = dataset_->problem(Task::kMotion, 0);
    const std::vector<Stance> stances = problem.stances;
    while (problem.stances.size() < kStances) {
      problem.stances.push_back(stances[problem.stances.size() % stances.size()]);
    }
    problem.stances.resize(kStances);
    ProblemSolver solver(dataset_, registry);
    return solver.Solve(Task::kMotion, problem, Initialization::kGood, method, {});
  }

  static constexpr std::size_t kStances = 16;
  test::TemporaryFolder temporary_;
  test::SyntheticFolder folder_;
  std::shared_ptr<const Dataset> dataset_;
};

/// Returns a result whose violation names the call.
SolverResult Answer(bool feasible, int call) {
  SolverResult result;
  result.feasible = feasible;
  result.iterations = 1;
  result.value.cost = call;
  result.value.max_violation = feasible ? 0.0 : 1.0 + call;
  return result;
}

TEST_F(WindowBacktrack, GoesBackByThreeStancesEachTime) {
  Script script{.answer = [](int call) { return Answer(call != 2 && call != 3, call); }, .max_backtracks = 4};
  const SolveOutcome outcome = Run(script);
  // The third window fails, and so does the program with three more stances; with six more it is solved.
  EXPECT_EQ(script.num_waypoints, (std::vector<int>{12, 12, 12, 18, 24}));
  EXPECT_EQ(outcome.status, SolveStatus::kConvergedFeasible);
  EXPECT_EQ(outcome.windows_solved, 3);
  EXPECT_FALSE(outcome.unsolved);
  EXPECT_EQ(outcome.message, "");
  EXPECT_EQ(outcome.max_violation, 0.0) << "of the returned point";
  EXPECT_EQ(outcome.waypoints.size(), 2 * kStances);
  EXPECT_EQ(outcome.iterations, 5) << "all attempts count";
  EXPECT_EQ(outcome.restarts, 2) << "each backtrack is an attempt beyond the first";
  EXPECT_EQ(outcome.history.back().restart, 2);
  ASSERT_FALSE(outcome.history.empty());
  EXPECT_EQ(outcome.history.back().cost, 4.0);
}

TEST_F(WindowBacktrack, ReachesTheFirstStanceAndEnds) {
  Script script{.answer = [](int call) { return Answer(call == 0, call); }, .max_backtracks = 9};
  const SolveOutcome outcome = Run(script);
  // The second window begins with stance 5: three and then five more stances.
  EXPECT_EQ(script.num_waypoints, (std::vector<int>{12, 12, 18, 22}));
  EXPECT_EQ(outcome.status, SolveStatus::kConvergedInfeasible);
  EXPECT_EQ(outcome.windows_solved, 1);
  ASSERT_TRUE(outcome.unsolved);
  EXPECT_EQ(outcome.unsolved->first_stance, 5) << "the window itself";
  EXPECT_EQ(outcome.unsolved->max_violation, 2.0);
  EXPECT_EQ(outcome.waypoints.size(), 12U) << "the solved window is kept";
  EXPECT_EQ(outcome.iterations, 4);
  EXPECT_EQ(outcome.history.back().violation, 2.0) << "the returned point";
  EXPECT_EQ(outcome.history.back().restart, 0) << "which the first attempt found";
}

TEST_F(WindowBacktrack, IsAsOftenAsTheSolverAsks) {
  const auto fails = [](int call) { return Answer(call == 0, call); };
  Script never{.answer = fails, .max_backtracks = 0};
  Run(never);
  EXPECT_EQ(never.num_waypoints, (std::vector<int>{12, 12}));
  Script once{.answer = fails, .max_backtracks = 1};
  Run(once);
  EXPECT_EQ(once.num_waypoints, (std::vector<int>{12, 12, 18}));
}

TEST_F(WindowBacktrack, IsNoHelpForAWaypointThatHasNoSolutionAlone) {
  Script script{.answer =
                    [](int call) {
                      SolverResult result = Answer(call == 0, call);
                      result.waypoint_unsolved = !result.feasible;
                      return result;
                    },
                .max_backtracks = 4};
  Run(script);
  EXPECT_EQ(script.num_waypoints, (std::vector<int>{12, 12}));
}

TEST_F(WindowBacktrack, AStopKeepsTheWindowItself) {
  Script script{.answer = [](int call) { return Answer(call == 0, call); }, .max_backtracks = 4};
  script.cancelled_at = 2;
  const SolveOutcome outcome = Run(script);
  EXPECT_EQ(script.num_waypoints, (std::vector<int>{12, 12, 18}));
  EXPECT_EQ(outcome.status, SolveStatus::kCancelled);
  ASSERT_TRUE(outcome.unsolved);
  EXPECT_EQ(outcome.unsolved->first_stance, 5);
  EXPECT_EQ(outcome.unsolved->max_violation, 2.0) << "its own best point, not that of the cancelled attempt";
}

TEST_F(WindowBacktrack, FiguresOfReplacedWindowsAreForgotten) {
  Script script{.answer =
                    [](int call) {
                      SolverResult result = Answer(call != 2, call);
                      result.margin_relaxed = call == 1 ? 1.0 : 0.0;
                      return result;
                    },
                .max_backtracks = 4};
  const SolveOutcome outcome = Run(script);
  EXPECT_EQ(script.num_waypoints, (std::vector<int>{12, 12, 12, 18}));
  EXPECT_EQ(outcome.margin_relaxed, 1.0) << "stances 5 and 6 are still those of the second window";
  script.num_waypoints.clear();
  script.answer = [](int call) {
    SolverResult result = Answer(call != 2 && call != 3, call);
    result.margin_relaxed = call == 1 ? 1.0 : 0.0;
    return result;
  };
  EXPECT_EQ(Run(script).margin_relaxed, 0.0) << "all its stances were solved again";
}

TEST_F(WindowBacktrack, TheFirstWindowHasNothingBeforeIt) {
  Script script{.answer = [](int call) { return Answer(false, call); }, .max_backtracks = 4};
  Run(script);
  EXPECT_EQ(script.num_waypoints, (std::vector<int>{12}));
}

}  // namespace
}  // namespace legopt
