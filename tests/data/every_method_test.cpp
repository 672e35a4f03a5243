// Every method of the registry on problems of the default dataset, so that no row of a table gets worse unnoticed. A
// method must solve as many problems (of motions: windows) as measured before, less the margin of that measurement's
// Wilson interval, at no more than 1.1 times the measured cost. The program prints its measurements.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/statistics/hypothesis_tests.h"
#include "tests/folders.h"

namespace legopt {
namespace {

/// Measured results of a method.
struct Measured {
  int solved;          ///< problems, or windows if solved window by window
  double median_cost;  ///< per waypoint, over the solved problems
};

struct MethodRow {
  const char* name;
  const char* method;
  Measured postures;
  std::optional<Measured> motions;  ///< empty: motions take too long for a test
  bool slow_motions = false;        ///< motions take minutes: tested by scripts/nightly only

  friend std::ostream& operator<<(std::ostream& out, const MethodRow& row) { return out << row.name; }
};

// No method restarts: a restart would hide a failure of the first try.
constexpr MethodRow kRows[] = {
    {"Sqp", R"({"solver": "sqp"})", {49, 332.9}, {{42, 0.1142}}},
    {"SqpSampled", R"({"solver": "sqp", "sample_size": 80})", {27, 421.6}, {{0, 0}}},
    {"SqpIncremental", R"({"solver": "sqp", "sample_size": 80, "incremental": true})", {49, 376}, {{42, 0.1185}}},
    {"Best", R"({"solver": "best"})", {50, 293.5}, {{42, 0.1078}}},
    {"BestOneStart", R"({"solver": "best", "options": {"rescues": 0}})", {49, 292.9}, {{42, 0.1078}}},
    {"Ipopt", R"({"solver": "ipopt"})", {49, 292.1}, {{18, 0.07956}}, true},
    {"Sgd", R"({"solver": "sgd"})", {47, 560.4}, {{40, 0.1856}}},
    {"SgdSampled", R"({"solver": "sgd", "sample_size": 80})", {47, 694.4}, {{40, 0.1944}}},
    {"SgdIncremental", R"({"solver": "sgd", "sample_size": 40, "incremental": true})", {48, 596.9}, {{40, 0.1731}}},
    {"Adam", R"({"solver": "adam"})", {48, 537.8}, {{42, 0.1399}}},
    {"AdamSampled", R"({"solver": "adam", "sample_size": 80})", {48, 540}, {{40, 0.1687}}},
    {"AdamIncremental", R"({"solver": "adam", "sample_size": 40, "incremental": true})", {48, 600.1}, {{40, 0.1797}}},
    {"Nadam", R"({"solver": "nadam"})", {48, 501.5}, {{41, 0.1556}}},
    {"NadamSampled", R"({"solver": "nadam", "sample_size": 80})", {49, 494}, {{41, 0.1531}}},
    {"NadamIncremental", R"({"solver": "nadam", "sample_size": 40, "incremental": true})", {48, 495.1}, {{40, 0.1719}}},
    {"Chomp", R"({"solver": "chomp"})", {50, 428.6}, {{42, 0.2045}}},
    {"Stomp", R"({"solver": "stomp"})", {50, 379.4}, {{42, 0.1487}}, true},
    {"CmaEs", R"({"solver": "cma_es"})", {50, 520.8}, std::nullopt},
};

Method MethodOf(const MethodRow& row) { return Method::FromJson(nlohmann::json::parse(row.method), row.name); }

std::shared_ptr<const Dataset> DefaultDataset() {
  static const std::shared_ptr<const Dataset> dataset = Dataset::Load(SourceFolder() + "/data/garage-easier");
  return dataset;
}

/// Returns the problems of a row; they are solved from the initial guess in collision.
std::vector<ProblemDefinition> ProblemsOf(Task task, std::size_t longest) {
  std::vector<ProblemDefinition> problems;
  for (const ProblemDefinition& problem : DefaultDataset()->problems(task)) {
    if (problem.stances.size() <= longest) problems.push_back(problem);
  }
  return problems;
}

class EveryMethod : public ::testing::TestWithParam<MethodRow> {
 protected:
  static void Hold(Task task, const std::vector<ProblemDefinition>& problems, const Measured& measured) {
    ASSERT_FALSE(problems.empty());
    const Found found = Solve(task, problems);
    std::printf("%s, %s: {%d, %.4g} of %d\n", GetParam().name, std::string(ToString(task)).c_str(), found.solved,
                found.median_cost, found.parts);
    EXPECT_GE(found.solved, std::floor(statistics::WilsonInterval(measured.solved, found.parts).lower * found.parts));
    constexpr double kMaxCostRatio = 1.1;
    EXPECT_LE(found.median_cost, kMaxCostRatio * measured.median_cost);
  }

 private:
  struct Found : Measured {
    int parts = 0;  ///< windows of all problems, or problems if there are none
  };

  static Found Solve(Task task, const std::vector<ProblemDefinition>& problems) {
    ProblemSolver solver(DefaultDataset());
    Judge judge(DefaultDataset());
    Found found = {};
    std::vector<double> costs;
    for (const ProblemDefinition& problem : problems) {
      SolveSettings settings;
      settings.effort_limit = DescriptionOf(task).default_effort_limit;
      const SolveOutcome outcome =
          solver.Solve(task, problem, Initialization::kInCollision, MethodOf(GetParam()), settings);
      const Evaluation evaluation = judge.Evaluate(task, problem, outcome.waypoints);
      const bool success = evaluation.literal == Verdict::kSuccess;
      if (success) costs.push_back(evaluation.cost);
      found.parts += std::max(outcome.windows, 1);
      // A motion whose windows were all solved but which is rejected as a whole does not count as solved.
      const bool whole = outcome.windows_solved == outcome.windows;
      if (success || !whole) found.solved += std::max(outcome.windows_solved, success ? 1 : 0);
    }
    std::sort(costs.begin(), costs.end());
    found.median_cost = costs.empty() ? 0.0 : costs[costs.size() / 2];
    return found;
  }
};

TEST_P(EveryMethod, SolvesPosturesAsMeasured) {
  Hold(Task::kPosture, ProblemsOf(Task::kPosture, 1), GetParam().postures);
}

class EveryMethodOnMotions : public EveryMethod {};

TEST_P(EveryMethodOnMotions, SolvesShortOnesAsMeasured) {
  if (GetParam().slow_motions && std::getenv("LEGOPT_NIGHTLY") == nullptr) {
    GTEST_SKIP() << "takes minutes: LEGOPT_NIGHTLY=1 runs it, as scripts/nightly does";
  }
  constexpr std::size_t kLongest = 50;  // stances
  Hold(Task::kMotion, ProblemsOf(Task::kMotion, kLongest), *GetParam().motions);
}

std::vector<MethodRow> RowsWithMotions() {
  std::vector<MethodRow> rows;
  std::ranges::copy_if(kRows, std::back_inserter(rows), [](const MethodRow& row) { return row.motions.has_value(); });
  return rows;
}

INSTANTIATE_TEST_SUITE_P(Registry, EveryMethod, ::testing::ValuesIn(kRows),
                         [](const auto& row) { return std::string(row.param.name); });
INSTANTIATE_TEST_SUITE_P(Registry, EveryMethodOnMotions, ::testing::ValuesIn(RowsWithMotions()),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(EveryMethodOfTheRegistry, HasARow) {
  for (const SolverEntry& entry : SolverRegistry()) {
    const auto has = [&](bool sampled, bool incremental) {
      return std::ranges::any_of(kRows, [&](const MethodRow& row) {
        const Method method = MethodOf(row);
        return method.solver == entry.word && (method.sample_size_percent < 100) == sampled &&
               method.incremental == incremental;
      });
    };
    EXPECT_TRUE(has(false, false)) << entry.word;
    if (!entry.samples) continue;
    EXPECT_TRUE(has(true, false)) << entry.word << ", sampled";
    EXPECT_TRUE(has(true, true)) << entry.word << ", incremental";
  }
}

}  // namespace
}  // namespace legopt
