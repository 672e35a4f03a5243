// A custom solver, registered by a program outside of the library: described, checked and hashed like the others, and
// used for solving. Also serves as an example.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/input_error.h"
#include "tests/solvers/analytic_program.h"

namespace outside {

enum class StepRule : std::uint8_t { kShrinking, kFixed };

}  // namespace outside

template <>
inline constexpr auto legopt::kEnumNames<outside::StepRule> = legopt::MakeEnumNames<outside::StepRule>(
    {{outside::StepRule::kShrinking, "shrinking"}, {outside::StepRule::kFixed, "fixed"}});

namespace outside {

using Eigen::VectorXd;

/// Options of the compass search below.
struct CompassOptions {
  double step = 0.5;         ///< first length, > least_step
  double least_step = 1e-6;  ///< > 0
  int max_iterations = 10'000;
  StepRule rule = StepRule::kShrinking;
  double penalty = 100.0;              ///< mu, > 0
  double constraint_tolerance = 1e-3;  ///< limit of each violation, > 0

  static void Visit(auto& options, auto& fields) {
    fields.Number("step", options.step, 1e-9, 10.0);
    fields.Number("least_step", options.least_step, 1e-12, 1.0);
    fields.Integer("max_iterations", options.max_iterations, 1, 1'000'000);
    fields.Choice("rule", options.rule);
    fields.Number("penalty", options.penalty, 1e-6, 1e12);
    fields.Number("constraint_tolerance", options.constraint_tolerance, 1e-9, 1.0);
    fields.Require(options.step > options.least_step, "step", "least_step", std::to_string(options.step),
                   "must exceed least_step", "raise it");
  }
};

/// Tries a step in both directions along each variable in turn; halves it if none reduces the merit.
class CompassSolver : public legopt::Solver {
 public:
  explicit CompassSolver(const CompassOptions& options) : options_(options) {}

  legopt::SolverResult Solve(legopt::Program& program, VectorXd& x, const legopt::SolverContext& context) override {
    legopt::SolverResult result;
    program.ProjectOnBounds(x);
    result.value = legopt::EvaluateObjective(program, x, scratch_);
    result.status = legopt::SolveStatus::kNumericalFailure;
    if (result.value.IsFinite()) result.status = Search(program, x, context, result);
    result.feasible = result.value.max_violation < options_.constraint_tolerance;
    if (result.status == legopt::SolveStatus::kConvergedFeasible && !result.feasible) {
      result.status = legopt::SolveStatus::kConvergedInfeasible;
    }
    return result;
  }

 private:
  legopt::SolveStatus Search(legopt::Program& program, VectorXd& x, const legopt::SolverContext& context,
                             legopt::SolverResult& result) {
    for (double step = options_.step; step > options_.least_step;) {
      if (const auto stop = context.Stopped()) return *stop;
      if (++result.iterations > options_.max_iterations) return legopt::SolveStatus::kIterationLimit;
      if (TryAll(program, x, step, result)) continue;
      if (options_.rule == StepRule::kFixed) break;
      step /= 2.0;
    }
    return legopt::SolveStatus::kConvergedFeasible;
  }

  bool TryAll(legopt::Program& program, VectorXd& x, double step, legopt::SolverResult& result) {
    bool moved = false;
    VectorXd lower = VectorXd::Zero(program.num_waypoints() * program.tangent_size()), upper = lower, next = x;
    for (Eigen::Index i = 0; i < lower.size(); ++i) {
      for (const double way : {-step, step}) {
        program.StepBounds(x, lower, upper);
        VectorXd dx = VectorXd::Zero(lower.size());
        dx[i] = std::clamp(way, lower[i], upper[i]);
        program.Retract(x, dx, next);
        const legopt::ObjectiveValue value = legopt::EvaluateObjective(program, next, scratch_);
        if (!(value.Merit(options_.penalty) < result.value.Merit(options_.penalty))) continue;
        x = next;
        result.value = value;
        moved = true;
      }
    }
    return moved;
  }

  CompassOptions options_;
  std::vector<double> scratch_;
};

legopt::SolverRegistry WithCompass() {
  legopt::SolverRegistry registry;
  registry.Register<CompassOptions>(
      {.word = "compass", .paper_name = "Compass search"},
      [](const CompassOptions& options, const legopt::Sampling&) { return std::make_unique<CompassSolver>(options); });
  return registry;
}

using legopt::InputError;
using legopt::Method;
using legopt::SolverRegistry;
using nlohmann::json;
using ::testing::HasSubstr;

TEST(OwnSolver, IsReadWrittenAndHashedLikeTheOthers) {
  const SolverRegistry registry = WithCompass();
  const json description = {{"solver", "compass"}, {"multi_starts", 3}, {"options", {{"step", 2}, {"rule", "fixed"}}}};
  const Method method = Method::FromJson(description, "mine.json", registry);
  EXPECT_EQ(method.name, "Compass search");
  EXPECT_EQ(method.options.As<CompassOptions>().step, 2.0);
  EXPECT_EQ(method.options.As<CompassOptions>().rule, StepRule::kFixed);
  EXPECT_EQ(method.ToJson()["options"]["rule"], "fixed");
  const Method again = Method::FromJson(method.ToJson(), "mine.json", registry);
  EXPECT_EQ(again.Hash(), method.Hash());
  EXPECT_NE(again.Hash(), Method::Of("compass", registry).Hash());
  EXPECT_THROW(method.options.As<StepRule>(), std::bad_any_cast);
}

TEST(OwnSolver, FaultsAreToldAllTogether) {
  try {
    Method::FromJson({{"solver", "compass"},
                      {"sample_size", 80},
                      {"options", {{"steps", 2}, {"rule", "shrink"}, {"step", 1e-7}, {"contact_range_m", 2}}}},
                     "mine.json", WithCompass());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "mine.json: options.contact_range_m: must be a number from 0.001 to 1.0 (got '2')\n"
                 "mine.json: options.rule: is not known (got 'shrink'); did you mean 'shrinking'? valid: shrinking, "
                 "fixed\n"
                 "mine.json: options.steps: unknown key; did you mean 'step'? valid: restart_noise_deg, collision, "
                 "pairs, physics, collision_margin_m, contact_range_m, continuous_collision, continuous_weight, step, "
                 "least_step, "
                 "max_iterations, rule, penalty, constraint_tolerance\n"
                 "mine.json: options.step: must exceed least_step (got '0.000000'); raise it\n"
                 "mine.json: sample_size: solver compass uses all terms (got '80'); leave sample_size at 100");
  }
}

TEST(OwnSolver, SolvesAndStops) {
  const SolverRegistry registry = WithCompass();
  legopt::AnalyticProgram program(VectorXd::Constant(2, -2.0), VectorXd::Constant(2, 0.5));
  program.Add(legopt::TermKind::kCost, [](const VectorXd& x) { return VectorXd(x - Eigen::Vector2d(1, -1)); });
  const auto solver = MakeSolver(Method::Of("compass", registry), registry);
  VectorXd x = Eigen::Vector2d(0.1, 0.2);
  const legopt::SolverResult result = solver->Solve(program, x, {});
  EXPECT_EQ(result.status, legopt::SolveStatus::kConvergedFeasible);
  EXPECT_TRUE(result.feasible);
  EXPECT_LT((x - Eigen::Vector2d(0.5, -1)).norm(), 1e-5);
  const auto stop = [] { return std::optional(legopt::SolveStatus::kCancelled); };
  EXPECT_EQ(solver->Solve(program, x, {stop, nullptr, nullptr}).status, legopt::SolveStatus::kCancelled);
}

TEST(OwnSolver, IsKnownOnlyWhereItsRegistryIs) {
  const SolverRegistry registry = WithCompass();
  const Method method = Method::Of("compass", registry);
  EXPECT_THROW(MakeSolver(method), InputError);
  EXPECT_EQ(SolverRegistry().Find("compass"), nullptr);
  EXPECT_EQ(method.Hash(), Method::Of("compass", registry).Hash()) << "a hash takes no solver";
}

TEST(OwnSolver, AWordStandsForOneSolver) {
  SolverRegistry registry = WithCompass();
  const auto add = [&](const std::string& word) {
    registry.Register<CompassOptions>({.word = word}, [](const CompassOptions& options, const legopt::Sampling&) {
      return std::make_unique<CompassSolver>(options);
    });
  };
  EXPECT_THROW(add("compass"), InputError);
  EXPECT_THROW(add("sqp"), InputError);
  EXPECT_THROW(add(""), InputError);
  add("compass2");
  EXPECT_EQ(registry.words().back(), "compass2");
  EXPECT_EQ(Method::Of("compass2", registry).name, "compass2");
}

TEST(OwnSolver, ThatIsNotMadeEndsTheProgramWithItsWord) {
  SolverRegistry registry;
  registry.Register<CompassOptions>(
      {.word = "none", .paper_name = "None"},
      [](const CompassOptions&, const legopt::Sampling&) { return std::unique_ptr<legopt::Solver>(); });
  const Method method = Method::Of("none", registry);
  EXPECT_DEATH(MakeSolver(method, registry), "legopt: broken invariant: a registered solver is made .got 'none'.");
}

}  // namespace outside
