// LegOpt-best: what its further starts are for.

#include "legopt/optimize/best_solver.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/optimize/analytic_program.h"

namespace legopt {
namespace {

using Eigen::VectorXd;

/// Two wells, the left one cheaper; SQP from the right ends in the right one.
void AddTwoWells(AnalyticProgram& program) {
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] * x[0] - 1.0); });
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(0.3 * (x[0] + 1.0)); });
}

SolverResult Solve(const BestOptions& options, AnalyticProgram& program, VectorXd& x) {
  std::mt19937_64 generator(3);
  SolverContext context;
  context.generator = &generator;
  return BestSolver(options).Solve(program, x, context);
}

TEST(Best, RefinementsFindTheCheaperWell) {
  AnalyticProgram program(One(-2), One(2));
  AddTwoWells(program);
  BestOptions options;
  options.refinement_noise = 2.0;
  options.refinements = 0;
  VectorXd x = One(1.5);
  const SolverResult once = Solve(options, program, x);
  EXPECT_NEAR(x[0], 0.95, 0.1);
  options.refinements = 20;
  x = One(1.5);
  const SolverResult best = Solve(options, program, x);
  EXPECT_NEAR(x[0], -1.0, 0.1);
  EXPECT_LT(best.value.cost, once.value.cost);
  EXPECT_GT(best.iterations, once.iterations);
  EXPECT_EQ(once.starts, 1);
  EXPECT_EQ(best.starts, 1 + options.refinements);
}

/// x (x^2 - 1) > 0.5 holds right of 1.19 only; left of there the slope leads into a valley.
void AddPit(AnalyticProgram& program) {
  program.Add(TermKind::kInequality, [](const VectorXd& x) { return One(0.5 - x[0] * (x[0] * x[0] - 1.0)); });
}

TEST(Best, RescuesStartWhereTheFirstAttemptFailed) {
  AnalyticProgram program(One(-1), One(3));
  AddPit(program);
  BestOptions options;
  options.rescue_noise = 3.0;
  options.rescues = 0;
  VectorXd x = One(-0.9);
  EXPECT_FALSE(Solve(options, program, x).feasible);
  options.rescues = 20;
  x = One(-0.9);
  EXPECT_TRUE(Solve(options, program, x).feasible);
  EXPECT_GT(x[0], 1.19);
}

TEST(Best, FreeVariablesAreNotScattered) {
  const double infinity = std::numeric_limits<double>::infinity();
  AnalyticProgram program(Eigen::Vector2d(-2, -infinity), Eigen::Vector2d(2, infinity));
  AddTwoWells(program);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(std::cos(x[1])); });
  BestOptions options;
  options.refinements = 50;
  options.refinement_noise = 9.0;
  VectorXd x = Eigen::Vector2d(1.5, M_PI / 2);
  Solve(options, program, x);
  EXPECT_NEAR(x[1], M_PI / 2, 1e-3) << "the next optimum of the free variable is far away";
}

}  // namespace
}  // namespace legopt
