// One catalogue of small programs for every solver of the registry. Requirements on each variant:
//   * all terms per iteration: the known optimum, within the accuracy stated in kAccuracies;
//   * sampled variants, which stop early or omit terms by design: only correct reports.
// Correct report: the point is finite and within bounds, the value is the value there, the feasible flag follows from
// it, the status agrees with both, and a feasible initial guess is never replaced by a worse feasible point.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <ostream>

#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "tests/solvers/analytic_program.h"

namespace legopt {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using nlohmann::json;

/// Required accuracy at a known optimum of a solver with all terms. The last row applies to solvers without their own.
struct Accuracy {
  const char* word;
  const char* options;  ///< options that achieve this accuracy; the catalogue's scale is 1
  double distance;      ///< largest component of the distance to the optimum
  double violation;     ///< largest violation
};

// A penalty just above the multipliers, since higher ones shorten first-order steps along a constraint, and many
// steps.
constexpr const char* kPatientDescent = R"({"initial_penalty": 5, "min_improve_frac": 1e-9, "max_epochs": 20000,
                                            "max_epochs_when_satisfied": 1000,
                                            "max_epochs_without_improvement": 1000})";
constexpr double kOwnTolerance = 5e-4;  // tolerance of methods on robots

constexpr Accuracy kAccuracies[] = {
    // Models without the curvature of constraints allow only short steps along them, hence many.
    {"sqp", R"({"min_approx_improve_frac": 1e-6, "min_approx_improve": 1e-9, "min_trust_box_size": 1e-6,
                "max_iterations": 2000})",
     2e-2, 1e-4},
    {"best", R"({"min_approx_improve_frac": 1e-6, "min_approx_improve": 1e-9, "min_trust_box_size": 1e-6,
                 "max_iterations": 2000, "subproblem_accuracy_frac": 1e-8, "polish_violations": true,
                 "constraint_tolerance": 1e-4})",
     2e-2, 1e-4},
    {"ipopt", R"({"stagnation_frac": 0.0})", 1e-3, 1e-4},
    // First-order and derivative-free methods.
    {"sgd", kPatientDescent, 0.06, kOwnTolerance},
    {"adam", kPatientDescent, 0.06, kOwnTolerance},
    {"nadam", kPatientDescent, 0.06, kOwnTolerance},
    {"chomp", kPatientDescent, 0.1, kOwnTolerance},
    // Its updates weight each waypoint separately, so they do not end at the minimum of the sum.
    {"stomp", kPatientDescent, 0.2, kOwnTolerance},
    {"cma_es", R"({"initial_penalty": 5, "min_improve_frac": 1e-7})", 1e-2, kOwnTolerance},
    {"", "{}", 0.15, kOwnTolerance},
};

const Accuracy& AccuracyOf(const std::string& word) {
  const Accuracy* row = std::begin(kAccuracies);
  while (*row->word != '\0' && word != row->word) ++row;
  return *row;
}

struct SolverVariant {
  std::string word;
  int percent = 100;
  bool incremental = false;

  Method MakeMethod() const {
    return Method::FromJson({{"solver", word},
                             {"sample_size", percent},
                             {"incremental", incremental},
                             {"options", json::parse(AccuracyOf(word).options)}},
                            "");
  }
  friend std::ostream& operator<<(std::ostream& out, const SolverVariant& v) {
    return out << v.word << (v.percent < 100 ? "Sampled" : "") << (v.incremental ? "Incremental" : "");
  }
};

std::vector<SolverVariant> Variants() {
  constexpr int kHalf = 50;
  std::vector<SolverVariant> variants;
  for (const SolverEntry& entry : SolverRegistry()) {
    variants.push_back({entry.word});
    if (!entry.samples) continue;
    variants.push_back({entry.word, kHalf, false});
    variants.push_back({entry.word, kHalf, true});
  }
  return variants;
}

/// A program of two or more terms with an initial guess and, if it exists, the optimum.
struct Example {
  const char* name;
  std::unique_ptr<AnalyticProgram> program;
  VectorXd start;
  VectorXd optimum;
};

std::unique_ptr<AnalyticProgram> BoxedPlane(double limit) {
  return std::make_unique<AnalyticProgram>(VectorXd::Constant(2, -limit), VectorXd::Constant(2, limit));
}

/// Attracts both coordinates to a point, each by a separate term.
void AddPull(AnalyticProgram& program, const Vector2d& to) {
  for (int i = 0; i < 2; ++i) {
    program.Add(TermKind::kCost, [to, i](const VectorXd& x) { return One(x[i] - to[i]); });
  }
}

Example Quadratic() {
  auto program = BoxedPlane(kInfinity);
  AddPull(*program, {0.6, -0.8});
  return {"quadratic", std::move(program), Vector2d(0, 0), Vector2d(0.6, -0.8)};
}

Example ActiveBound() {
  auto program = BoxedPlane(0.5);
  AddPull(*program, {1.5, -2});
  return {"active bound", std::move(program), Vector2d(9, 9), Vector2d(0.5, -0.5)};
}

Example Circle() {
  auto program = BoxedPlane(3);
  AddPull(*program, {1.2, 1.6});
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x.squaredNorm() - 1.0); });
  return {"circle", std::move(program), Vector2d(-0.3, 0.8), Vector2d(0.6, 0.8)};
}

Example ActiveInequality() {
  auto program = BoxedPlane(5);
  AddPull(*program, {0, 0});
  program->Add(TermKind::kInequality, [](const VectorXd& x) { return One(1.0 - x[0] * x[1]); });
  return {"active inequality", std::move(program), Vector2d(1.5, 2), Vector2d(1, 1)};
}

/// The preference holds at the cost of other terms, since its weight exceeds the multiplier.
Example MetPreference() {
  auto program = BoxedPlane(5);
  AddPull(*program, {1, 0});
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x.sum() - 1.0); });
  program->AddShaped({"wish", TermKind::kPreference, 0, 1, -1, 10.0},
                     [](const VectorXd& x) { return One(x[0] - 0.2); });
  return {"met preference", std::move(program), Vector2d(2, 2), Vector2d(0.2, 0.8)};
}

/// An equality contradicts the preference: the program is feasible nevertheless.
Example ForbiddenPreference() {
  auto program = BoxedPlane(5);
  AddPull(*program, {0, 0.5});
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] - 1.0); });
  program->AddShaped({"wish", TermKind::kPreference, 0, 1, -1, 1.0}, [](const VectorXd& x) { return One(x[0] - 0.2); });
  return {"forbidden preference", std::move(program), Vector2d(2, 2), Vector2d(1, 0.5)};
}

Example InactiveInequality() {
  auto program = BoxedPlane(5);
  AddPull(*program, {1, 1});
  program->Add(TermKind::kInequality, [](const VectorXd& x) { return One(x.sum() - 5.0); });
  return {"inactive inequality", std::move(program), Vector2d(0, 0), Vector2d(1, 1)};
}

/// A disc with a limited range, like a contact.
Example RowThatComesAndGoes() {
  constexpr double kRange = 0.1;
  auto program = BoxedPlane(5);
  AddPull(*program, {0.2, 0});
  program->AddShaped(
      {"disc", TermKind::kInequality},
      [](const VectorXd& x) { return x.norm() < 1.0 + kRange ? One(1.0 - x.norm()) : VectorXd(); }, -kRange);
  return {"row that comes and goes", std::move(program), Vector2d(2, 1), Vector2d(1, 0)};
}

/// Four waypoints on a line: the first fixed at 0, the last required at 1.5, squared steps as costs.
Example Chain() {
  constexpr int kWaypoints = 4;
  VectorXd lower = VectorXd::Constant(2 * kWaypoints, -3), upper = VectorXd::Constant(2 * kWaypoints, 3);
  lower.head(2).setZero();
  upper.head(2).setZero();
  auto program = std::make_unique<AnalyticProgram>(lower, upper, kWaypoints);
  for (int t = 0; t + 1 < kWaypoints; ++t) {
    program->AddShaped({"step", TermKind::kCost, t, 2},
                       [](const VectorXd& x) { return VectorXd(x.tail(2) - x.head(2)); });
  }
  program->AddShaped({"end", TermKind::kEquality, kWaypoints - 1},
                     [](const VectorXd& x) { return VectorXd(x - Vector2d(1.5, 0)); });
  VectorXd optimum = VectorXd::Zero(2 * kWaypoints);
  for (int t = 0; t < kWaypoints; ++t) optimum[2 * t] = 0.5 * t;
  return {"chain", std::move(program), VectorXd::Constant(2 * kWaypoints, 0.4), optimum};
}

std::vector<Example> Solvable() {
  std::vector<Example> examples;
  for (auto make : {Quadratic, ActiveBound, Circle, ActiveInequality, InactiveInequality, MetPreference,
                    ForbiddenPreference, RowThatComesAndGoes, Chain}) {
    examples.push_back(make());
  }
  return examples;
}

Example Infeasible() {
  auto program = BoxedPlane(2);
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0]); });
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] - 1.0); });
  program->Add(TermKind::kInequality, [](const VectorXd& x) { return One(x[1] - 1.0); });
  return {"infeasible", std::move(program), Vector2d(0.2, 0.1), {}};
}

/// More equalities than variables, but compatible ones.
Example Overdetermined() {
  auto program = BoxedPlane(2);
  AddPull(*program, {0, 0});
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return VectorXd(x - Vector2d(0.5, 0.25)); });
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x.sum() - 0.75); });
  return {"overdetermined", std::move(program), Vector2d(-0.2, 0.1), Vector2d(0.5, 0.25)};
}

Example SaddleAtTheStart() {
  auto program = BoxedPlane(2);
  AddPull(*program, {0, 0});
  program->Add(TermKind::kEquality, [](const VectorXd& x) { return One(x[0] * x[1] + 1.0); });
  return {"saddle", std::move(program), Vector2d(0, 0), {}};
}

/// Undefined for x < 0.2; the cost attracts to the left.
Example PartlyUndefined() {
  auto program = BoxedPlane(2);
  AddPull(*program, {-1, 0});
  program->Add(TermKind::kCost, [](const VectorXd& x) { return One(x[0] < 0.2 ? std::nan("") : 0.1 * x[0]); });
  return {"partly undefined", std::move(program), Vector2d(0.37, 0.5), {}};
}

class SolverConformance : public ::testing::TestWithParam<SolverVariant> {
 protected:
  SolverConformance()
      : method_(GetParam().MakeMethod()), accuracy_(AccuracyOf(method_.solver)), solver_(MakeSolver(method_)) {
    tolerance_ = method_.ToJson()["options"].value("constraint_tolerance", 0.0);
  }

  bool full() const { return GetParam().percent == 100; }

  SolverResult Run(Solver& solver, Example& example, VectorXd& x, const StopCheck& stop = {}) {
    std::mt19937_64 generator(7);
    x = example.start;
    return solver.Solve(*example.program, x, {stop, &generator, nullptr});
  }

  SolverResult Solve(Example& example, VectorXd& x, const StopCheck& stop = {}) {
    const SolverResult result = Run(*solver_, example, x, stop);
    ExpectHonest(example, x, result);
    return result;
  }

  void ExpectHonest(Example& example, const VectorXd& x, const SolverResult& result) {
    SCOPED_TRACE(example.name);
    ASSERT_TRUE(x.allFinite());
    VectorXd inside = x;
    example.program->ProjectOnBounds(inside);
    EXPECT_EQ(inside, x) << "out of bounds";
    std::vector<double> scratch;
    const ObjectiveValue value = EvaluateObjective(*example.program, x, scratch);
    ASSERT_TRUE(value.IsFinite());
    EXPECT_EQ(result.value.cost, value.cost);
    EXPECT_EQ(result.value.preference, value.preference);
    EXPECT_EQ(result.value.max_violation, value.max_violation);
    EXPECT_EQ(result.feasible, value.max_violation < tolerance_);
    EXPECT_FALSE(result.status == SolveStatus::kConvergedFeasible && !result.feasible);
    EXPECT_FALSE(result.status == SolveStatus::kConvergedInfeasible && result.feasible);
    EXPECT_NE(result.status, SolveStatus::kNotRun);
    ExpectNoWorseThanStart(example, value);
  }

  void ExpectNoWorseThanStart(Example& example, const ObjectiveValue& value) {
    VectorXd start = example.start;
    example.program->ProjectOnBounds(start);
    std::vector<double> scratch;
    const ObjectiveValue before = EvaluateObjective(*example.program, start, scratch);
    if (!(before.max_violation < tolerance_)) return;
    EXPECT_LT(value.max_violation, tolerance_);
    EXPECT_LE(value.Objective(), before.Objective() * (1 + 1e-12));
  }

  /// Checks that the fields of a record are plausible for the kind of solver.
  void ExpectPlausible(const IterationRecord& record) const {
    const std::string& word = GetParam().word;
    const bool sqp = word == "sqp" || word == "best";
    EXPECT_EQ(record.window, 0);
    EXPECT_EQ(record.restart, 0);
    EXPECT_EQ(record.penalty > 0.0, word != "ipopt") << record.penalty;
    EXPECT_EQ(record.trust_box > 0.0, sqp) << record.trust_box;
    EXPECT_LE(record.trust_box, 10.0);
    EXPECT_GE(record.cost, 0.0);  // a sum of squares
    EXPECT_GE(record.violation, 0.0);
    EXPECT_TRUE(!record.accepted || (std::isfinite(record.cost) && std::isfinite(record.violation)));
  }

  void ExpectOptimum(Example& example) {
    SCOPED_TRACE(example.name);
    VectorXd x;
    const SolverResult result = Solve(example, x);
    if (!full()) return;
    EXPECT_LE((x - example.optimum).cwiseAbs().maxCoeff(), accuracy_.distance) << x.transpose();
    EXPECT_LE(result.value.max_violation, accuracy_.violation);
  }

  Method method_;
  const Accuracy& accuracy_;
  std::unique_ptr<Solver> solver_;
  double tolerance_ = 0.0;
};

TEST_P(SolverConformance, TheRegistryNamesATolerance) { EXPECT_GT(tolerance_, 0.0) << "options.constraint_tolerance"; }

TEST_P(SolverConformance, KnownOptima) {
  for (Example& example : Solvable()) ExpectOptimum(example);
}

TEST_P(SolverConformance, CompatibleEqualitiesBeyondTheVariables) {
  Example example = Overdetermined();
  ExpectOptimum(example);
}

TEST_P(SolverConformance, InfeasibleIsNotCalledFeasible) {
  Example example = Infeasible();
  VectorXd x;
  const SolverResult result = Solve(example, x);
  EXPECT_FALSE(result.feasible);
  EXPECT_NE(result.status, SolveStatus::kConvergedFeasible);
  EXPECT_GE(result.value.max_violation, 0.5 - 1e-9);
  EXPECT_GE(result.value.worst_term, 0);
}

TEST_P(SolverConformance, SaddleAtTheStartStaysHonest) {
  Example example = SaddleAtTheStart();
  VectorXd x;
  Solve(example, x);
}

TEST_P(SolverConformance, UndefinedRegionsAreKeptOutOf) {
  Example example = PartlyUndefined();
  VectorXd x;
  Solve(example, x);
  EXPECT_GE(x[0], 0.2);
  EXPECT_LE(x[0], 0.37 + accuracy_.distance);
}

TEST_P(SolverConformance, UndefinedStartIsANumericalFailure) {
  Example example = PartlyUndefined();
  example.start = Vector2d(-0.5, 0.5);
  VectorXd x;
  const SolverResult result = Run(*solver_, example, x);
  EXPECT_EQ(result.status, SolveStatus::kNumericalFailure);
  EXPECT_FALSE(result.feasible);
  EXPECT_EQ(x, example.start);
}

TEST_P(SolverConformance, StopsAtOnce) {
  for (const SolveStatus reason : {SolveStatus::kCancelled, SolveStatus::kTimeLimit}) {
    for (Example& example : Solvable()) {
      VectorXd x;
      EXPECT_EQ(Solve(example, x, [reason] { return reason; }).status, reason) << example.name;
    }
  }
}

TEST_P(SolverConformance, StopsOnTheWay) {
  constexpr int kPatience = 3;  // further calls until the solver leaves its loops
  for (const int allowed : {1, 2, 5, 20}) {
    for (Example& example : Solvable()) {
      int polls = 0;
      VectorXd x;
      const SolverResult result =
          Solve(example, x, [&] { return ++polls > allowed ? std::optional(SolveStatus::kCancelled) : std::nullopt; });
      EXPECT_EQ(result.status == SolveStatus::kCancelled, polls > allowed) << example.name;
      EXPECT_LE(polls, allowed + kPatience) << example.name;
    }
  }
}

TEST_P(SolverConformance, RepeatsBitByBit) {
  for (auto make : {Circle, ActiveInequality, RowThatComesAndGoes, Chain, Infeasible, SaddleAtTheStart}) {
    Example example = make();
    SCOPED_TRACE(example.name);
    VectorXd first, second, third;
    const SolverResult a = Run(*solver_, example, first);
    const SolverResult b = Run(*solver_, example, second);  // reuses the workspace
    Example again = make();
    const SolverResult c = Run(*MakeSolver(method_), again, third);
    EXPECT_EQ(first, second);
    EXPECT_EQ(first, third);
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.status, c.status);
    EXPECT_EQ(a.iterations, b.iterations);
    EXPECT_EQ(a.iterations, c.iterations);
  }
}

TEST_P(SolverConformance, HistoryOnlyWatches) {
  Example example = Circle();
  VectorXd x;
  const SolverResult unwatched = Run(*solver_, example, x);
  std::vector<IterationRecord> history;
  std::mt19937_64 generator(7);
  VectorXd watched_x = example.start;
  const SolverResult watched = solver_->Solve(*example.program, watched_x, {{}, &generator, &history});
  EXPECT_EQ(watched_x, x);
  EXPECT_EQ(watched.iterations, unwatched.iterations);
  EXPECT_EQ(watched.value.cost, unwatched.value.cost);
  EXPECT_EQ(watched.value.max_violation, unwatched.value.max_violation);
  ASSERT_FALSE(history.empty());
  for (const IterationRecord& record : history) ExpectPlausible(record);
}

TEST_P(SolverConformance, HistoryEndsAtTheReturnedPoint) {
  std::vector<Example> examples = Solvable();
  for (auto make : {Infeasible, Overdetermined, SaddleAtTheStart, PartlyUndefined}) examples.push_back(make());
  for (Example& example : examples) {
    SCOPED_TRACE(example.name);
    std::vector<double> scratch;
    VectorXd x = example.start;
    example.program->ProjectOnBounds(x);
    const ObjectiveValue start = EvaluateObjective(*example.program, x, scratch);
    std::vector<IterationRecord> history = {{.cost = -1.0, .accepted = true}};  // an earlier attempt
    std::mt19937_64 generator(7);
    const SolverResult result = solver_->Solve(*example.program, x, {{}, &generator, &history});
    EXPECT_EQ(history[0].cost, -1.0);
    history.erase(history.begin());
    const auto last =
        std::find_if(history.rbegin(), history.rend(), [](const auto& record) { return record.accepted; });
    EXPECT_EQ(result.value.cost, last == history.rend() ? start.cost : last->cost);
    EXPECT_EQ(result.value.max_violation, last == history.rend() ? start.max_violation : last->violation);
  }
}

/// One attempt at one window, so the records need no index.
TEST_P(SolverConformance, PenaltiesOfTheHistoryNeverFall) {
  for (Example& example : Solvable()) {
    SCOPED_TRACE(example.name);
    std::vector<IterationRecord> history;
    std::mt19937_64 generator(7);
    VectorXd x = example.start;
    const SolverResult result = solver_->Solve(*example.program, x, {{}, &generator, &history});
    EXPECT_GE(history.size(), 1u);
    EXPECT_GE(result.iterations, 1);
    if (GetParam().word == "best") continue;  // several solves, each from the first penalty
    for (size_t i = 1; i < history.size(); ++i) EXPECT_GE(history[i].penalty, history[i - 1].penalty) << i;
  }
}

INSTANTIATE_TEST_SUITE_P(Registry, SolverConformance, ::testing::ValuesIn(Variants()),
                         [](const auto& variant) { return ::testing::PrintToString(variant.param); });

}  // namespace
}  // namespace legopt
