// SGD, Adam, Nadam, CHOMP and STOMP on small problems with known optima, and the correctness of their reports on
// problems without a solution.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "legopt/math/random_numbers.h"
#include "legopt/solvers/internal/gradient_solver.h"
#include "legopt/solvers/methods/method.h"
#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

constexpr double kCloseEnough = 0.02;  // first-order methods stop when steps no longer improve

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
    // A first penalty just above the multipliers (at most 4). With larger penalties these methods move more slowly
    // along a constraint, and they stop as soon as they are feasible.
    const nlohmann::json options = {{"initial_penalty", 5.0}, {"min_improve_frac", 1e-7}, {"max_epochs", 5000}};
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
  // Undefined for x < 0.2. Both costs attract to the left, and a sample may contain only the defined one.
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
    EXPECT_EQ(history_.size(), GetParam().sample_size == 100 ? 3u : 1u) << "one per pass over the terms";
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

/// Ten terms, and a count of those evaluated at each point.
class CountingProgram : public AnalyticProgram {
 public:
  CountingProgram() : AnalyticProgram(Vector2d(-3, -3), Vector2d(3, 3)) {
    for (int i = 0; i < 8; ++i) {
      Add(TermKind::kCost, [i](const VectorXd& x) { return One(x[i % 2] - 0.1 * i); });
    }
    Add(TermKind::kEquality, [](const VectorXd& x) { return One(x.squaredNorm() - 1.0); });
    Add(TermKind::kInequality, [](const VectorXd& x) { return One(x[0] - 0.5); });
    seen_.resize(terms().size());
  }

  void SetPoint(Eigen::Ref<const VectorXd> x) override {
    Count();
    AnalyticProgram::SetPoint(x);
  }

  /// Returns a list whose entry n is the number of points at which n terms were evaluated.
  const std::vector<int>& points() {
    Count();
    return points_;
  }

 private:
  void Count() {
    size_t looked_at = 0;
    for (size_t k = 0; k < seen_.size(); ++k) {
      looked_at += terms()[k]->evaluations() > seen_[k] ? 1 : 0;
      seen_[k] = terms()[k]->evaluations();
    }
    points_.resize(seen_.size() + 1);
    ++points_[looked_at];
  }

  std::vector<std::int64_t> seen_;
  std::vector<int> points_;
};

class Batches : public ::testing::TestWithParam<Variant> {};

TEST_P(Batches, AreAllThatAnIterationLooksAt) {
  CountingProgram program;
  constexpr int kPenalties = 3;
  const auto solver = MakeSolver(
      Method::FromJson({{"solver", GetParam().solver},
                        {"sample_size", GetParam().sample_size},
                        {"incremental", GetParam().incremental},
                        {"options", {{"max_penalty_iterations", kPenalties}, {"max_epochs_when_satisfied", 10}}}},
                       ""));
  std::mt19937_64 generator(7);
  VectorXd x = Vector2d(-1, 2);
  const int iterations = solver->Solve(program, x, {{}, &generator, nullptr}).iterations;
  const int batch = GetParam().sample_size / 10;
  const int epochs = iterations / ((10 + batch - 1) / batch);
  const std::vector<int>& points = program.points();
  ASSERT_GT(epochs, 3);
  // In addition to batches, all terms are evaluated at the start, at each end of an epoch, and with incremental
  // sampling once at each penalty.
  EXPECT_LE(points[10], 1 + epochs + (GetParam().incremental ? kPenalties : 0));
  EXPECT_GE(points[10], 1 + epochs);
  EXPECT_GE(points[static_cast<size_t>(batch)], iterations) << "a look and a search each";
  for (int n = 1; n < 10; ++n) {
    if (n != batch) {
      EXPECT_EQ(points[static_cast<size_t>(n)], 0) << n;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Sampled, Batches,
                         ::testing::Values(Variant{"sgd", 80}, Variant{"adam", 80}, Variant{"nadam", 80},
                                           Variant{"sgd", 40, true}, Variant{"adam", 40, true},
                                           Variant{"nadam", 40, true}));

TEST(SmoothObjective, ModelsOfLinearRowsAreTheRows) {
  AnalyticProgram program = Plane();
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Vector2d(3, 4)); });
  program.Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] - 2.0 * x[1]); });
  program.Add(TermKind::kInequality, [](const VectorXd& x) { return One(x.sum() - 1.0); });
  const TermMask all(3, 1), costs = {1, 0, 0}, constraints = {0, 1, 1};
  SmoothObjective objective;
  objective.Reset(program, 10.0);
  objective.set_penalty(7.0);
  TermGradients gradients;
  gradients.Reset(program);
  TermModels models(3);
  const Vector2d x(0.3, 0.1), dx(0.5, 0.4);  // the equality changes its sign, the inequality is violated
  objective.ValueAndGradients(x, all, gradients, models);
  VectorXd by_models = Vector2d::Zero(), there;
  const double value = objective.ModelValue(models, costs, dx, by_models);
  EXPECT_NEAR(value, objective.Value(x + dx, constraints), 1e-6);
  objective.Gradients(constraints, gradients);
  gradients.Sum(program, constraints, there);
  EXPECT_LT((by_models - there).norm(), 1e-6);
  ShiftModels(program, dx, models);
  by_models.setZero();
  EXPECT_NEAR(objective.ModelValue(models, costs, Vector2d::Zero(), by_models), value, 1e-9);
}

TEST(GradientSolver, DirectionsAreOfRememberedModelsWhenToldSo) {
  const auto solve = [](const char* memory) {
    CountingProgram program;
    const nlohmann::json options = {{"memory", memory}};
    const auto solver = MakeSolver(
        Method::FromJson({{"solver", "sgd"}, {"sample_size", 40}, {"incremental", true}, {"options", options}}, ""));
    std::mt19937_64 generator(7);
    VectorXd x = Vector2d(-1, 2);
    EXPECT_TRUE(solver->Solve(program, x, {{}, &generator, nullptr}).feasible) << memory;
    return x;
  };
  EXPECT_NE(solve("models"), solve("gradients"));
}

TEST(GradientSolver, TakesNoShortStepUphill) {
  AnalyticProgram program = Plane();
  // |x| + |y|: no point near a kink has a sufficiently small slope.
  program.Add(TermKind::kCost, [](const VectorXd& x) { return VectorXd(x.cwiseAbs().cwiseSqrt()); });
  std::vector<IterationRecord> history;
  VectorXd x = Vector2d(0.3, 0.7);
  const auto solver = MakeSolver(Method::FromJson({{"solver", "sgd"}, {"options", {{"short_step", 0.25}}}}, ""));
  solver->Solve(program, x, {{}, nullptr, &history});
  ASSERT_GT(history.size(), 2u);
  for (size_t i = 1; i < history.size(); ++i) EXPECT_LE(history[i].cost, history[i - 1].cost) << i;
  EXPECT_LT(history.back().cost, 0.8);
}

TEST(PenaltySolver, PassesOverTheTermsAreCountedNotIterations) {
  for (const int percent : {100, 40}) {
    CountingProgram program;
    const nlohmann::json options = {{"max_epochs", 4}, {"max_penalty_iterations", 1}, {"min_improve_frac", 0.0}};
    const auto solver = MakeSolver(Method::FromJson(
        {{"solver", "sgd"}, {"sample_size", percent}, {"incremental", true}, {"options", options}}, ""));
    std::mt19937_64 generator(7);
    VectorXd x = Vector2d(-1, 2);
    const SolverResult result = solver->Solve(program, x, {{}, &generator, nullptr});
    EXPECT_EQ(result.iterations, percent == 100 ? 4 : 12);
    EXPECT_EQ(result.status, SolveStatus::kIterationLimit);
  }
}

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

TEST(NormalRandom, HaveUnitVarianceAndRepeat) {
  constexpr int kDraws = 20000;
  std::mt19937_64 generator(3), again(3);
  NormalRandom draws, same;
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
