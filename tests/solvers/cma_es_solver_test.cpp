// CMA-ES in the penalty loop: bounds and fixed variables in more dimensions than in the conformance catalogue.
#include "legopt/solvers/internal/cma_es_solver.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <optional>

#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

constexpr int kVariables = 10;

/// Returns a program that attracts coordinate i to (i + 1) / 5. The bounds are -1 and 1, so the last five are at a
/// bound.
std::unique_ptr<AnalyticProgram> PulledBeyondItsBounds() {
  auto program = std::make_unique<AnalyticProgram>(Eigen::VectorXd::Constant(kVariables, -1.0),
                                                   Eigen::VectorXd::Constant(kVariables, 1.0));
  program->Add(TermKind::kCost, [](const Eigen::VectorXd& x) {
    return Eigen::VectorXd(x - Eigen::VectorXd::LinSpaced(kVariables, 0.2, 2.0));
  });
  return program;
}

SolverResult SolveByCmaEs(Program& program, Eigen::VectorXd& x, unsigned seed) {
  CmaEsOptions options;
  options.penalty.min_improve_frac = 1e-9;  // to the optimum, not to a thousandth of the cost
  CmaEsSolver solver(options);
  std::mt19937_64 generator(seed);
  return solver.Solve(program, x, {{}, &generator, nullptr});
}

TEST(CmaEsSolver, EndsAtTheBoundsThatItIsPulledBeyond) {
  const auto program = PulledBeyondItsBounds();
  const Eigen::VectorXd optimum = Eigen::VectorXd::LinSpaced(kVariables, 0.2, 2.0).cwiseMin(1.0);
  for (unsigned seed = 1; seed <= 5; ++seed) {
    Eigen::VectorXd x = Eigen::VectorXd::Constant(kVariables, -0.9);
    EXPECT_TRUE(SolveByCmaEs(*program, x, seed).feasible);
    EXPECT_LT((x - optimum).cwiseAbs().maxCoeff(), 1e-3) << x.transpose();
  }
}

TEST(CmaEsSolver, LeavesFixedVariablesAlone) {
  Eigen::VectorXd lower = Eigen::VectorXd::Constant(kVariables, -5.0), upper = -lower;
  for (int i = 0; i < kVariables; i += 2) lower[i] = upper[i] = 0.25;
  AnalyticProgram program(lower, upper);
  program.Add(TermKind::kCost, [](const Eigen::VectorXd& x) { return x; });
  program.Add(TermKind::kEquality, [](const Eigen::VectorXd& x) { return One(x.sum() - 3.75); });
  Eigen::VectorXd x = Eigen::VectorXd::Zero(kVariables);
  const SolverResult result = SolveByCmaEs(program, x, 3);
  EXPECT_TRUE(result.feasible);
  for (int i = 0; i < kVariables; i += 2) {
    EXPECT_EQ(x[i], 0.25);
    EXPECT_NEAR(x[i + 1], 0.5, 5e-3);
  }
}

TEST(CmaEsSolver, APointWithoutFreeVariablesStays) {
  const Eigen::VectorXd only = Eigen::VectorXd::Constant(2, 0.5);
  AnalyticProgram program(only, only);
  program.Add(TermKind::kEquality, [](const Eigen::VectorXd& x) { return One(x.sum() - 1.0); });
  Eigen::VectorXd x = only;
  EXPECT_TRUE(SolveByCmaEs(program, x, 1).feasible);
  EXPECT_EQ(x, only);
}

/// Returns the term evaluations of one generation of the attempt number `restart`.
std::int64_t EvaluationsOfAGeneration(double population_growth, int restart) {
  CmaEsOptions options;
  options.population_growth = population_growth;
  CmaEsSolver solver(options);
  const auto program = PulledBeyondItsBounds();
  std::mt19937_64 generator(1);
  int checks = 0;
  std::int64_t before = 0, after = 0;
  SolverContext context;
  context.generator = &generator;
  context.restart = restart;
  context.stop = [&]() -> std::optional<SolveStatus> {
    ++checks;
    if (checks == 1) before = program->TermEvaluations();
    if (checks == 2) after = program->TermEvaluations();
    return checks == 2 ? std::optional(SolveStatus::kCancelled) : std::nullopt;
  };
  Eigen::VectorXd x = Eigen::VectorXd::Zero(kVariables);
  solver.Solve(*program, x, context);
  return after - before;
}

TEST(CmaEsSolver, EachRestartTakesMoreSamples) {
  // 4 + floor(3 ln 10) samples and the mean.
  EXPECT_EQ(EvaluationsOfAGeneration(2.0, 0), 10 + 1);
  EXPECT_EQ(EvaluationsOfAGeneration(2.0, 1), 20 + 1);
  EXPECT_EQ(EvaluationsOfAGeneration(2.0, 3), 80 + 1);
  EXPECT_EQ(EvaluationsOfAGeneration(1.5, 2), 22 + 1);
  EXPECT_EQ(EvaluationsOfAGeneration(1.0, 9), 10 + 1);
}

TEST(CmaEsSolver, TheNumberOfSamplesIsBounded) {
  EXPECT_EQ(EvaluationsOfAGeneration(2.0, 8), 2560 + 1);
  EXPECT_EQ(EvaluationsOfAGeneration(10.0, 1'000'000), 5'000 + 1);
}

}  // namespace
}  // namespace legopt
