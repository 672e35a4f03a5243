// CMA-ES in the penalty loop: bounds and fixed variables in more dimensions than in the conformance catalogue.
#include "legopt/solvers/internal/cma_es_solver.h"

#include <gtest/gtest.h>

#include <memory>

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

}  // namespace
}  // namespace legopt
