// Both subproblem solvers on one catalogue: known optima, and the same optimum from both on random problems.

#include <gtest/gtest.h>

#include <memory>

#include "legopt/solvers/subproblem/block_kernels.h"
#include "legopt/solvers/subproblem/interior_point.h"
#include "legopt/solvers/subproblem/ipopt_subproblem.h"
#include "tests/solvers/subproblem/random_subproblem.h"

namespace legopt {
namespace {

constexpr double kAccuracy = 1e-7;

enum class Kind { kInteriorPoint, kIpopt };

std::unique_ptr<SubproblemSolver> Make(Kind kind) {
  if (kind == Kind::kIpopt) return std::make_unique<IpoptSubproblemSolver>();
  return std::make_unique<InteriorPointSolver>();
}

LinearModel OneRow(std::vector<double> coefficients, double value) {
  LinearModel model;
  model.Reset(1, static_cast<int>(coefficients.size()), 1);
  model.value(0) = value;
  for (size_t j = 0; j < coefficients.size(); ++j) model.row(0, 0)[j] = coefficients[j];
  return model;
}

class Subproblem : public ::testing::TestWithParam<Kind> {
 protected:
  Eigen::VectorXd Solve(const ConvexSubproblem& problem) {
    Eigen::VectorXd dx = Eigen::VectorXd::Constant(problem.num_blocks() * problem.block_size(), 1e9);
    result_ = Make(GetParam())->Solve(problem, {.gap = kAccuracy}, dx);
    EXPECT_EQ(result_.status, SubproblemSolver::Status::kSolved);
    return dx;
  }
  SubproblemSolver::Result result_;
};

ConvexSubproblem Scalar(double lower, double upper) {
  ConvexSubproblem problem(1, 1);
  problem.SetBounds(Eigen::VectorXd::Constant(1, lower), Eigen::VectorXd::Constant(1, upper));
  return problem;
}

TEST_P(Subproblem, QuadraticInsideTheBox) {
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddCost(0, OneRow({2.0}, -1.0));  // (2x - 1)^2
  EXPECT_NEAR(Solve(problem)[0], 0.5, 1e-3);
}

TEST_P(Subproblem, QuadraticAtTheBound) {
  ConvexSubproblem problem = Scalar(-1, 0.2);
  problem.AddCost(0, OneRow({2.0}, -1.0));
  EXPECT_NEAR(Solve(problem)[0], 0.2, 1e-6);
}

TEST_P(Subproblem, StrongPenaltyHoldsExactly) {
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddCost(0, OneRow({1.0}, -1.0));                                 // (x - 1)^2, optimum 1
  problem.AddPenalties(0, OneRow({1.0}, 0.3), TermKind::kEquality, 10.0);  // 10 |x + 0.3|
  EXPECT_NEAR(Solve(problem)[0], -0.3, 1e-6);
}

TEST_P(Subproblem, WeakPenaltyGivesWay) {
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddCost(0, OneRow({1.0}, -0.5));
  problem.AddPenalties(0, OneRow({1.0}, 0.0), TermKind::kInequality, 0.4);  // slope 0.4 against 2 (x - 0.5)
  EXPECT_NEAR(Solve(problem)[0], 0.3, 1e-3);
}

TEST_P(Subproblem, InactiveInequalityDoesNothing) {
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddCost(0, OneRow({1.0}, -0.5));
  problem.AddPenalties(0, OneRow({1.0}, -0.9), TermKind::kInequality, 1e6);
  EXPECT_NEAR(Solve(problem)[0], 0.5, 1e-3);
}

TEST_P(Subproblem, ContradictingEqualitiesMeetAtTheHeavierOne) {
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddPenalties(0, OneRow({1.0}, 0.0), TermKind::kEquality, 3.0);
  problem.AddPenalties(0, OneRow({1.0}, -0.5), TermKind::kEquality, 1.0);
  EXPECT_NEAR(Solve(problem)[0], 0.0, 1e-6);
}

TEST_P(Subproblem, NoTermsAtAll) {
  const ConvexSubproblem problem = Scalar(-1, 1);
  const double x = Solve(problem)[0];
  EXPECT_LE(std::abs(x), 1.0);
}

TEST_P(Subproblem, PaperPenalties) {
  for (double weight = 1e2; weight < 2e12; weight *= 10) {
    ConvexSubproblem problem = Scalar(-0.1, 0.1);
    problem.AddCost(0, OneRow({1.0}, -1.0));
    problem.AddPenalties(0, OneRow({1.0}, 0.03), TermKind::kEquality, weight);
    EXPECT_NEAR(Solve(problem)[0], -0.03, 1e-7) << weight;
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, Subproblem, ::testing::Values(Kind::kInteriorPoint, Kind::kIpopt),
                         [](const auto& solver) { return solver.param == Kind::kIpopt ? "Ipopt" : "InteriorPoint"; });

/// `ipopt_accuracy`: relative distance of Ipopt's own result from the optimum. The interior-point solver must never be
/// worse.
void ExpectSameOptimum(const RandomSubproblemShape& shape, unsigned seed, double ipopt_accuracy = 1e-5) {
  const ConvexSubproblem problem = MakeRandomSubproblem(shape, seed);
  const Eigen::Index size = static_cast<Eigen::Index>(shape.num_blocks) * shape.block_size;
  Eigen::VectorXd ours(size), theirs(size);
  const auto own = InteriorPointSolver().Solve(problem, {.gap = kAccuracy}, ours);
  const auto other = IpoptSubproblemSolver().Solve(problem, {.gap = kAccuracy}, theirs);
  ASSERT_EQ(own.status, SubproblemSolver::Status::kSolved) << "seed " << seed << " gap " << own.gap;
  ASSERT_EQ(other.status, SubproblemSolver::Status::kSolved);
  const double value = problem.Value(ours);
  EXPECT_NEAR(value, problem.Value(theirs), ipopt_accuracy * std::abs(value)) << "seed " << seed;
  EXPECT_LE(value, problem.Value(theirs) + 1e-6 * std::abs(value)) << "seed " << seed;
  EXPECT_LT(own.iterations, 25);
  for (int i = 0; i < shape.fixed_variables; ++i) EXPECT_EQ(ours[i], 0.0);
}

TEST(SubproblemSolvers, AgreeOnPostures) {
  for (unsigned seed = 1; seed <= 20; ++seed) ExpectSameOptimum({}, seed);
}

TEST(SubproblemSolvers, AgreeOnHeavyPenalties) {
  RandomSubproblemShape shape;
  shape.weight = 1e6;
  constexpr double kIpoptAccuracy = 1e-4;  // it stops at its "acceptable" level here
  for (unsigned seed = 1; seed <= 10; ++seed) ExpectSameOptimum(shape, seed, kIpoptAccuracy);
}

TEST(SubproblemSolvers, AgreeOnChains) {
  RandomSubproblemShape shape{.num_blocks = 5,
                              .block_size = 9,
                              .cost_rows = 4,
                              .equality_rows = 3,
                              .inequality_rows = 6,
                              .coupled = true,
                              .fixed_variables = 0};
  for (unsigned seed = 1; seed <= 10; ++seed) ExpectSameOptimum(shape, seed);
  shape.fixed_variables = 9;  // the first waypoint of a window
  for (unsigned seed = 11; seed <= 20; ++seed) ExpectSameOptimum(shape, seed);
}

TEST(SubproblemSolvers, AgreeOnChainsOfSteps) {
  RandomSubproblemShape shape{.num_blocks = 5,
                              .block_size = 9,
                              .cost_rows = 0,
                              .equality_rows = 3,
                              .inequality_rows = 6,
                              .coupled = true,
                              .steps = true,
                              .fixed_variables = 9};
  for (const int rows : {0, 1, 6, 7}) {  // with more than six, a coupling is treated as dense
    shape.pair_rows = rows;
    for (unsigned seed = 1; seed <= 5; ++seed) ExpectSameOptimum(shape, seed);
  }
  shape.pair_rows = 2;
  shape.weight = 1e6;
  constexpr double kIpoptAccuracy = 1e-4;
  for (unsigned seed = 1; seed <= 5; ++seed) ExpectSameOptimum(shape, seed, kIpoptAccuracy);
}

TEST(SubproblemSolvers, AgreeOnAFullWindow) {
  ExpectSameOptimum({.num_blocks = 12, .cost_rows = 0, .coupled = true, .fixed_variables = 35}, 1);
}

TEST(InteriorPoint, ReportedGapBoundsTheError) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const ConvexSubproblem problem = MakeRandomSubproblem({}, seed);
    Eigen::VectorXd loose(35), tight(35);
    InteriorPointSolver solver;
    const auto result = solver.Solve(problem, {.gap = 1e-1}, loose);
    solver.Solve(problem, {.gap = 1e-9}, tight);
    EXPECT_LE(problem.Value(loose) - problem.Value(tight), result.gap + 1e-9);
  }
}

const RandomSubproblemShape kWindow = {.num_blocks = 4, .cost_rows = 0, .coupled = true, .fixed_variables = 35};

TEST(InteriorPoint, AStepThatEndsEarlyHasItsShareOfThePossibleDecrease) {
  for (const RandomSubproblemShape& shape : {RandomSubproblemShape{}, kWindow}) {
    int fewer = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) {
      const ConvexSubproblem problem = MakeRandomSubproblem(shape, seed);
      const Eigen::Index size = Eigen::Index{problem.num_blocks()} * problem.block_size();
      Eigen::VectorXd early(size), best(size);
      InteriorPointSolver solver;
      const auto result = solver.Solve(problem, {.gap = kAccuracy, .share = 0.9}, early);
      const int all = solver.Solve(problem, {.gap = kAccuracy}, best).iterations;
      EXPECT_EQ(result.status, SubproblemSolver::Status::kSolved);
      const double start = problem.Value(Eigen::VectorXd::Zero(size)), least = problem.Value(best);
      EXPECT_GE(start - problem.Value(early), 0.9 * (start - least) * (1.0 - 1e-9)) << seed;
      EXPECT_LE(problem.Value(early) - least, result.gap + 1e-9) << seed;
      fewer += result.iterations < all ? 1 : 0;
    }
    EXPECT_EQ(fewer, 20);
  }
}

TEST(InteriorPoint, EndsWhereNoStepCouldBeWorthIt) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const ConvexSubproblem problem = MakeRandomSubproblem(kWindow, seed);
    const Eigen::Index size = Eigen::Index{problem.num_blocks()} * problem.block_size();
    Eigen::VectorXd dx(size);
    InteriorPointSolver solver;
    solver.Solve(problem, {.gap = kAccuracy}, dx);
    const double possible = problem.Value(Eigen::VectorXd::Zero(size)) - problem.Value(dx);
    const int all = solver.Solve(problem, {.gap = kAccuracy, .share = 0.999}, dx).iterations;
    const auto hopeless = solver.Solve(problem, {.gap = kAccuracy, .share = 0.999, .negligible = 10.0 * possible}, dx);
    EXPECT_EQ(hopeless.status, SubproblemSolver::Status::kSolved);
    EXPECT_LT(hopeless.iterations, all) << seed;
    const auto worth = solver.Solve(problem, {.gap = kAccuracy, .share = 0.999, .negligible = 0.99 * possible}, dx);
    EXPECT_EQ(worth.iterations, all) << seed;  // a correct bound never stops a useful solve
    const auto exact = solver.Solve(problem, {.gap = kAccuracy, .negligible = 10.0 * possible}, dx);
    EXPECT_EQ(exact.iterations, hopeless.iterations) << seed;  // the share does not matter
  }
}

// The workspace's history must not matter.
TEST(InteriorPoint, SameInputSameBits) {
  const ConvexSubproblem others[] = {
      MakeRandomSubproblem({}, 6),
      MakeRandomSubproblem({.num_blocks = 5, .block_size = 17, .coupled = true, .pair_rows = 8}, 7)};
  for (const bool steps : {false, true}) {
    const ConvexSubproblem problem = MakeRandomSubproblem({.num_blocks = 3, .coupled = true, .steps = steps}, 5);
    Eigen::VectorXd first(105), second(105);
    InteriorPointSolver solver;
    solver.Solve(problem, {.gap = kAccuracy}, first);
    for (const ConvexSubproblem& other : others) {
      Eigen::VectorXd unrelated(Eigen::Index{other.num_blocks()} * other.block_size());
      solver.Solve(other, {.gap = kAccuracy}, unrelated);
      solver.Solve(problem, {.gap = kAccuracy}, second);
      EXPECT_EQ(first, second) << steps;
    }
  }
}

// Every code path of any processor, including wide vectors that this processor lacks.
TEST(InteriorPoint, BitsAreThoseOfEveryProcessor) {
  const auto& usual_doubles = kernels::ChosenKernels<double>();
  const auto& usual_floats = kernels::ChosenKernels<float>();
  for (const RandomSubproblemShape& shape :
       {RandomSubproblemShape{}, kWindow, RandomSubproblemShape{.num_blocks = 4, .coupled = true, .steps = true}}) {
    const ConvexSubproblem problem = MakeRandomSubproblem(shape, 3);
    const Eigen::Index size = Eigen::Index{problem.num_blocks()} * problem.block_size();
    Eigen::VectorXd first(size), other(size);
    kernels::ChooseKernels(*kernels::KernelsOf<double>(kernels::BlockVectors::kFour));
    kernels::ChooseKernels(*kernels::KernelsOf<float>(kernels::BlockVectors::kFour));
    InteriorPointSolver().Solve(problem, {.gap = kAccuracy}, first);
    for (const auto vectors : {kernels::BlockVectors::kTwoFours, kernels::BlockVectors::kEight}) {
      const auto* const doubles = kernels::KernelsOf<double>(vectors);
      const auto* const floats = kernels::KernelsOf<float>(vectors);
      if (doubles != nullptr) kernels::ChooseKernels(*doubles);  // null without AVX-512
      if (floats != nullptr) kernels::ChooseKernels(*floats);    // null without AVX2
      InteriorPointSolver().Solve(problem, {.gap = kAccuracy}, other);
      EXPECT_EQ(first, other);
    }
  }
  kernels::ChooseKernels(usual_doubles);
  kernels::ChooseKernels(usual_floats);
}

// These coefficients overflow in single precision, so double precision is used immediately.
TEST(InteriorPoint, CoefficientsBeyondSinglePrecision) {
  constexpr double kHuge = 1e39;
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddCost(0, OneRow({1.0}, 0.0));
  problem.AddPenalties(0, OneRow({kHuge}, -0.25 * kHuge), TermKind::kEquality, 1.0);
  Eigen::VectorXd dx(1);
  const auto result = InteriorPointSolver().Solve(problem, {.gap = 1e-9 * kHuge}, dx);
  EXPECT_EQ(result.status, SubproblemSolver::Status::kSolved);
  EXPECT_NEAR(dx[0], 0.25, 1e-8);
}

TEST(InteriorPoint, NonFiniteInputFails) {
  ConvexSubproblem problem = Scalar(-1, 1);
  problem.AddCost(0, OneRow({std::numeric_limits<double>::quiet_NaN()}, 1.0));
  Eigen::VectorXd dx(1);
  EXPECT_EQ(InteriorPointSolver().Solve(problem, {.gap = kAccuracy}, dx).status, SubproblemSolver::Status::kFailed);
}

}  // namespace
}  // namespace legopt
