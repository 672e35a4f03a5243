// SQP on small problems with known optima, and the correctness of its reports on problems without a solution.

#include "legopt/solvers/internal/sqp_solver.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

class SqpOnSmallProblems : public ::testing::TestWithParam<SubproblemMethod> {
 protected:
  SolverResult Solve(AnalyticProgram& program, VectorXd& x, const StopCheck& stop = {}) {
    SqpOptions options;
    options.subproblem = GetParam();
    options.min_approx_improve_frac = 1e-6;
    options.min_approx_improve = 1e-9;
    options.min_trust_box_size = 1e-6;
    options.max_iterations = 2000;  // curved constraints shorten the steps: the models have no curvature
    return SqpSolver(options).Solve(program, x, {stop, nullptr, &history_});
  }
  std::vector<IterationRecord> history_;
};

TEST_P(SqpOnSmallProblems, ClosestPointOfACircle) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x.squaredNorm() - 1.0); });
  VectorXd x = Vector2d(-0.3, 0.8);
  const auto result = Solve(program, x);
  EXPECT_EQ(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_NEAR(x[0], 0.6, 5e-3);
  EXPECT_NEAR(x[1], 0.8, 5e-3);
  EXPECT_NEAR(result.value.cost, 16.0, 1e-3);
  EXPECT_LT(result.value.max_violation, 1e-4);
}

TEST_P(SqpOnSmallProblems, BoundsAreNeverLeft) {
  AnalyticProgram program = Plane(0.5);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, -4)); });
  VectorXd x = Vector2d(9, 9);
  const auto result = Solve(program, x);
  EXPECT_EQ(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_LE(x.cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((x - Vector2d(0.5, -0.5)).norm(), 1e-6);
}

TEST_P(SqpOnSmallProblems, InequalityActiveAtTheOptimum) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x); });
  program.Add(TermKind::kInequality, [](const VectorXd& x) { return One(1.0 - x[0] * x[1]); });  // x y >= 1
  VectorXd x = Vector2d(2, 3);
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kConvergedFeasible);
  EXPECT_NEAR(x[0], 1.0, 0.02);
  EXPECT_NEAR(x[0] * x[1], 1.0, 1e-3);
}

TEST_P(SqpOnSmallProblems, RosenbrockValley) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost,
              [](const VectorXd& x) { return VectorXd(Vector2d(1.0 - x[0], 10.0 * (x[1] - x[0] * x[0]))); });
  VectorXd x = Vector2d(-1.2, 1.0);
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kConvergedFeasible);
  EXPECT_NEAR(x[0], 1.0, 1e-2);
  EXPECT_NEAR(x[1], 1.0, 2e-2);
}

TEST_P(SqpOnSmallProblems, InfeasibleIsSaidSo) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0]); });
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] - 1.0); });
  VectorXd x = Vector2d(0.2, 0.1);
  const auto result = Solve(program, x);
  EXPECT_EQ(result.status, SolveStatus::kConvergedInfeasible);
  EXPECT_GE(result.value.max_violation, 0.49);
  EXPECT_GE(result.value.worst_term, 0);
}

TEST_P(SqpOnSmallProblems, NotANumberAtTheStart) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(std::sqrt(x[0])); });
  VectorXd x = Vector2d(-1, 0);
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kNumericalFailure);
}

TEST_P(SqpOnSmallProblems, StepsIntoNotANumberAreRejected) {
  AnalyticProgram program = Plane();
  // Undefined for x < 0.2; the cost attracts to the left.
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] < 0.2 ? std::nan("") : x[0]); });
  VectorXd x = Vector2d(0.37, 0);
  const auto result = Solve(program, x);
  EXPECT_TRUE(result.value.IsFinite());
  EXPECT_GE(x[0], 0.2);
  EXPECT_LT(x[0], 0.3);
}

TEST_P(SqpOnSmallProblems, StartOnASaddleStaysHonest) {
  AnalyticProgram program = Plane(2.0);
  // The penalty of |x y + 1| has a saddle at the origin; the constraint is satisfied on the hyperbola.
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] * x[1] + 1.0); });
  VectorXd x = Vector2d(0, 0);
  const auto result = Solve(program, x);
  const bool met = std::abs(x[0] * x[1] + 1.0) < 1e-4;
  EXPECT_EQ(result.status, met ? SolveStatus::kConvergedFeasible : SolveStatus::kConvergedInfeasible);
}

TEST_P(SqpOnSmallProblems, StopsWhenAsked) {
  for (const SolveStatus reason : {SolveStatus::kCancelled, SolveStatus::kTimeLimit}) {
    AnalyticProgram program = Plane();
    program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
    VectorXd x = Vector2d(0, 0);
    int calls = 0;
    const auto result = Solve(program, x, [&] { return ++calls > 3 ? std::optional(reason) : std::nullopt; });
    EXPECT_EQ(result.status, reason);
    EXPECT_EQ(result.iterations, 3);
    EXPECT_GT(x.norm(), 0.0);
  }
}

// For one equality with one row, the largest violation is the total, so a record determines the merit F + mu V.
TEST_P(SqpOnSmallProblems, AcceptedStepsNeverRaiseTheMerit) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(std::sin(3 * x[0]) - x[1]); });
  VectorXd x = Vector2d(-1, 1);
  IterationRecord here = {.cost = (x - Vector2d(3, 4)).squaredNorm(), .violation = std::abs(std::sin(3 * x[0]) - x[1])};
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kConvergedFeasible);
  int accepted = 0, refused = 0;
  for (const IterationRecord& trial : history_) {
    SCOPED_TRACE(trial.step);
    EXPECT_GE(trial.penalty, here.penalty);
    const auto merit = [&](const IterationRecord& record) { return record.cost + trial.penalty * record.violation; };
    if (!trial.accepted) {
      ++refused;
      continue;
    }
    EXPECT_LE(merit(trial), merit(here));
    ++accepted;
    here = trial;
  }
  EXPECT_GT(accepted, 3);
  EXPECT_GT(refused, 0) << "nothing was there to be refused";
}

INSTANTIATE_TEST_SUITE_P(Subproblems, SqpOnSmallProblems,
                         ::testing::Values(SubproblemMethod::kInteriorPoint, SubproblemMethod::kIpopt),
                         [](const auto& method) { return std::string(ToString(method.param)); });

class FeasibleStops : public ::testing::Test {
 protected:
  /// Solves from a feasible point far from the optimum.
  SolverResult Solve(FeasibleStop stop, const Sampling& sampling) {
    AnalyticProgram program = Plane();
    program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
    program.Add(TermKind::kInequality, [](const VectorXd& x) { return One(x.squaredNorm() - 4.0); });
    SqpOptions options;
    options.stop_when_feasible = stop;
    options.min_approx_improve_frac = 1e-6;
    options.max_iterations = 2000;
    VectorXd x = Vector2d(-0.5, 0.2);
    std::mt19937_64 generator(7);
    const SolverResult result = SqpSolver(options, sampling).Solve(program, x, {{}, &generator, nullptr});
    EXPECT_TRUE(result.feasible);
    EXPECT_EQ(result.status, SolveStatus::kConvergedFeasible);
    return result;
  }

  static constexpr double kMinCost = 9.0;  // 3 from the circle
};

TEST_F(FeasibleStops, EndAfterTheFirstStepThatHolds) {
  EXPECT_EQ(Solve(FeasibleStop::kAlways, {}).iterations, 1);
  EXPECT_EQ(Solve(FeasibleStop::kAlways, {50, true}).iterations, 1);
}

TEST_F(FeasibleStops, AreIncrementalOnesUnlessToldOtherwise) {
  EXPECT_NEAR(Solve(FeasibleStop::kIncremental, {}).value.cost, kMinCost, 0.05);
  EXPECT_EQ(Solve(FeasibleStop::kIncremental, {50, true}).iterations, 1);
}

TEST_F(FeasibleStops, AreAbsentWhenToldSo) {
  EXPECT_NEAR(Solve(FeasibleStop::kNever, {}).value.cost, kMinCost, 0.05);
  EXPECT_NEAR(Solve(FeasibleStop::kNever, {50, true}).value.cost, kMinCost, 0.05);
}

TEST(Sqp, FeasibleButNotConvergedIsNotCalledConverged) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
  SqpOptions options;
  options.max_iterations = 2;
  VectorXd x = Vector2d(0, 0);
  const auto result = SqpSolver(options).Solve(program, x, {});
  EXPECT_EQ(result.status, SolveStatus::kIterationLimit);
  EXPECT_TRUE(result.feasible);
}

TEST(Sqp, IterationLimitIsReported) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] - 50.0); });  // steps well above convergence
  SqpOptions options;
  options.max_iterations = 2;
  options.max_penalty_iterations = 2;
  VectorXd x = Vector2d(0, 0);
  EXPECT_EQ(SqpSolver(options).Solve(program, x, {}).status, SolveStatus::kIterationLimit);
}

}  // namespace
}  // namespace legopt
