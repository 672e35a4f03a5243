// SGD, Adam, Nadam, CHOMP and STOMP on small problems with known optima, and their honesty on those that have none.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "legopt/methods/method.h"
#include "legopt/optimize/gradient_solver.h"
#include "legopt/optimize/waypoint_metric.h"
#include "legopt/random_draws.h"
#include "tests/optimize/analytic_program.h"

namespace legopt {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kCloseEnough = 0.02;  // first-order methods stop when a step no longer pays

struct Variant {
  std::string solver;
  int sample_size = 100;
  bool incremental = false;
};

void PrintTo(const Variant& v, std::ostream* out) { *out << (v.incremental ? "I-" : "") << v.solver << v.sample_size; }

class PenaltyMethods : public ::testing::TestWithParam<Variant> {
 protected:
  SolverResult Solve(AnalyticProgram& program, VectorXd& x, const StopCheck& stop = {}) {
    std::mt19937_64 generator(7);
    history_.clear();
    // A first penalty just above the multipliers (at most 4): the larger it is, the slower these methods are along a
    // constraint, and they stop at once when feasible.
    const nlohmann::json options = {{"initial_penalty", 5.0}, {"min_improve_frac", 1e-7}, {"max_iterations", 5000}};
    const auto solver = MakeSolver(Method::FromJson({{"solver", GetParam().solver},
                                                     {"sample_size", GetParam().sample_size},
                                                     {"incremental", GetParam().incremental},
                                                     {"options", options}},
                                                    ""));
    return solver->Solve(program, x, {stop, &generator, &history_});
  }
  std::vector<IterationRecord> history_;
};

TEST_P(PenaltyMethods, EqualityActiveAtTheOptimum) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x.squaredNorm() - 1.0); });
  VectorXd x = Vector2d(0.3, 0.8);
  const auto result = Solve(program, x);
  EXPECT_EQ(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_TRUE(result.feasible);
  EXPECT_NEAR(x.norm(), 1.0, 1e-3);
  if (GetParam().sample_size == 100) {
    EXPECT_LT((x - Vector2d(0.6, 0.8)).norm(), 10 * kCloseEnough);
  }
}

TEST_P(PenaltyMethods, BoundsAreNeverLeft) {
  AnalyticProgram program = Plane(0.5);
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, -4)); });
  VectorXd x = Vector2d(9, 9);
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kConvergedFeasible);
  EXPECT_LE(x.cwiseAbs().maxCoeff(), 0.5);
  EXPECT_LT((x - Vector2d(0.5, -0.5)).norm(), kCloseEnough);
}

TEST_P(PenaltyMethods, InequalityActiveAtTheOptimum) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x); });
  program.Add(TermKind::kInequality, [](const VectorXd& x) { return One(1.0 - x[0] * x[1]); });  // x y >= 1
  VectorXd x = Vector2d(1.4, 1.5);
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kConvergedFeasible);
  EXPECT_GE(x[0] * x[1], 1.0 - 1e-3);
  if (GetParam().sample_size == 100) {
    EXPECT_LT((x - Vector2d(1, 1)).norm(), 5 * kCloseEnough);
  }
}

TEST_P(PenaltyMethods, InfeasibleIsSaidSo) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0]); });
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] - 1.0); });
  VectorXd x = Vector2d(0.2, 0.1);
  const auto result = Solve(program, x);
  EXPECT_NE(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_FALSE(result.feasible);
  EXPECT_GE(result.value.max_violation, 0.49);
  EXPECT_GE(result.value.worst_term, 0);
}

TEST_P(PenaltyMethods, NotANumberAtTheStart) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(std::sqrt(x[0])); });
  VectorXd x = Vector2d(-1, 0);
  EXPECT_EQ(Solve(program, x).status, SolveStatus::kNumericalFailure);
}

TEST_P(PenaltyMethods, PointsThatAreNotANumberAreNeverReturned) {
  AnalyticProgram program = Plane();
  // Undefined left of 0.2; both costs pull to the left, and a sample may see the one that is defined only.
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] < 0.2 ? std::nan("") : x[0]); });
  program.Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] + 1.0); });
  VectorXd x = Vector2d(0.37, 0);
  const auto result = Solve(program, x);
  EXPECT_TRUE(result.value.IsFinite());
  EXPECT_GE(x[0], 0.2);
  EXPECT_LE(x[0], 0.37);
}

TEST_P(PenaltyMethods, StopsWhenAsked) {
  for (const SolveStatus reason : {SolveStatus::kCancelled, SolveStatus::kTimeLimit}) {
    AnalyticProgram program = Plane();
    program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
    program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] * x[1] - 30.0); });
    VectorXd x = Vector2d(0.1, 0.1);
    int calls = 0;
    const auto result = Solve(program, x, [&] { return ++calls > 3 ? std::optional(reason) : std::nullopt; });
    EXPECT_EQ(result.status, reason);
    EXPECT_EQ(result.iterations, 3);
    EXPECT_EQ(history_.size(), 3u);
  }
}

TEST_P(PenaltyMethods, SameGeneratorSameBits) {
  VectorXd first, second;
  for (VectorXd* x : {&first, &second}) {
    AnalyticProgram program = Plane(2.0);
    program.Add(TermKind::kCost, [](const VectorXd& p) { return VectorXd(p - Vector2d(3, 4)); });
    program.Add(TermKind::kEquality, [](const VectorXd& p) { return One(std::sin(3 * p[0]) - p[1]); });
    *x = Vector2d(-1, 1);
    Solve(program, *x);
  }
  EXPECT_EQ(first, second);
}

TEST_P(PenaltyMethods, TheReportedValueIsThatOfTheReturnedPoint) {
  AnalyticProgram program = Plane(2.0);
  program.Add(TermKind::kCost, [](const VectorXd& p) { return VectorXd(p - Vector2d(3, 4)); });
  program.Add(TermKind::kEquality, [](const VectorXd& p) { return One(std::sin(3 * p[0]) - p[1]); });
  VectorXd x = Vector2d(-1, 1);
  const auto result = Solve(program, x);
  std::vector<double> scratch;
  const ObjectiveValue value = EvaluateObjective(program, x, scratch);
  EXPECT_EQ(result.value.cost, value.cost);
  EXPECT_EQ(result.value.max_violation, value.max_violation);
}

INSTANTIATE_TEST_SUITE_P(Methods, PenaltyMethods,
                         ::testing::Values(Variant{"sgd"}, Variant{"adam"}, Variant{"nadam"}, Variant{"chomp"},
                                           Variant{"stomp"}, Variant{"sgd", 50}, Variant{"adam", 50},
                                           Variant{"nadam", 50}, Variant{"sgd", 50, true}, Variant{"adam", 50, true},
                                           Variant{"nadam", 50, true}));

class WithAllTerms : public ::testing::TestWithParam<std::string> {};

TEST_P(WithAllTerms, MemoryOfFreshGradientsIsTheFullGradient) {
  VectorXd points[2];
  int iterations[2];
  for (const bool incremental : {false, true}) {
    AnalyticProgram program = Plane(2.0);
    program.Add(TermKind::kCost, [](const VectorXd& p) { return VectorXd(p - Vector2d(3, 4)); });
    program.Add(TermKind::kEquality, [](const VectorXd& p) { return One(std::sin(3 * p[0]) - p[1]); });
    VectorXd& x = points[incremental ? 1 : 0];
    x = Vector2d(-1, 1);
    std::mt19937_64 generator(1);
    const auto solver = MakeSolver(Method::FromJson({{"solver", GetParam()}, {"incremental", incremental}}, ""));
    iterations[incremental ? 1 : 0] = solver->Solve(program, x, {{}, &generator, nullptr}).iterations;
  }
  EXPECT_EQ(points[0], points[1]);
  EXPECT_EQ(iterations[0], iterations[1]);
}

INSTANTIATE_TEST_SUITE_P(Solvers, WithAllTerms, ::testing::Values("sgd", "adam", "nadam"));

TEST(MomentDirections, AreThePapersEquations) {
  AnalyticProgram program = Plane();
  const VectorXd gradients[] = {Vector2d(1, -2), Vector2d(3, 0.5)};
  for (const bool nesterov : {false, true}) {
    MomentDirection rule({}, nesterov);
    rule.Reset(program);
    Eigen::Array2d m = Eigen::Array2d::Zero(), v = m;
    VectorXd direction = Vector2d::Zero();
    for (int k = 1; k <= 2; ++k) {
      const Eigen::Array2d g = gradients[k - 1].array();
      m = 0.9 * m + 0.1 * g;
      v = 0.999 * v + 0.001 * g.square();
      const double share = 1 - std::pow(0.9, k);
      const Eigen::Array2d m_hat =
          nesterov ? Eigen::Array2d(0.9 * m / (1 - std::pow(0.9, k + 1)) + 0.1 * g / share) : Eigen::Array2d(m / share);
      const Eigen::Array2d expected = m_hat / ((v / (1 - std::pow(0.999, k))).sqrt() + 1e-8);
      rule.Next(gradients[k - 1], direction);
      EXPECT_LT((direction.array() - expected).abs().maxCoeff(), 1e-12) << k;
    }
  }
}

TEST(WaypointMetric, IsTheInverseOfTheSmoothedIdentityAndKeepsCommonChanges) {
  constexpr int kWaypoints = 4, kBlock = 3;
  constexpr double kSmoothness = 7.0;
  WaypointMetric metric;
  metric.Reset(kWaypoints, kBlock, {kSmoothness});
  VectorXd v = VectorXd::LinSpaced(kWaypoints * kBlock, -1.0, 2.0).array().sin();
  const VectorXd original = v;
  metric.ApplyInverse(v);
  for (int t = 0; t < kWaypoints; ++t) {  // A v, row by row
    VectorXd row = v.segment(t * kBlock, kBlock);
    for (const int other : {t - 1, t + 1}) {
      if (other < 0 || other >= kWaypoints) continue;
      row += kSmoothness * (v.segment(t * kBlock, kBlock) - v.segment(other * kBlock, kBlock));
    }
    EXPECT_LT((row - original.segment(t * kBlock, kBlock)).norm(), 1e-12);
  }
  VectorXd common = VectorXd::Constant(kWaypoints * kBlock, 0.3);
  metric.ApplyInverse(common);
  EXPECT_LT((common.array() - 0.3).abs().maxCoeff(), 1e-12);
  metric.Reset(1, kBlock, {kSmoothness});
  VectorXd alone = VectorXd::LinSpaced(kBlock, 1, 3);
  const VectorXd before = alone;
  metric.ApplyInverse(alone);
  metric.Correlate(alone);
  EXPECT_EQ(alone, before);
}

TEST(NormalDraws, HaveUnitVarianceAndRepeat) {
  constexpr int kDraws = 20000;
  std::mt19937_64 generator(3), again(3);
  NormalDraws draws, same;
  double sum = 0, squares = 0;
  for (int i = 0; i < kDraws; ++i) {
    const double draw = draws.Next(generator);
    EXPECT_EQ(draw, same.Next(again));
    sum += draw;
    squares += draw * draw;
  }
  EXPECT_NEAR(sum / kDraws, 0.0, 0.03);
  EXPECT_NEAR(squares / kDraws, 1.0, 0.05);
}

}  // namespace
}  // namespace legopt
