// The same job gives the same bits, for every solver of the registry and both tasks, after any earlier solves.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <ostream>

#include "legopt/planning/internal/trace.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/solvers/methods/iterations_key.h"

namespace legopt {
namespace {

struct Variant {
  std::string word;
  bool incremental = false;

  /// Returns a method with a few iterations and restarts: the result may be poor, but all random numbers are used.
  Method Make(const char* collision) const {
    nlohmann::json description = {
        {"solver", word}, {"multi_starts", 1}, {"options", {{test::IterationsKey(word), 6}, {"collision", collision}}}};
    if (word != "ipopt") description["options"]["max_penalty_iterations"] = 2;
    if (incremental) description.update({{"sample_size", 50}, {"incremental", true}});
    return Method::FromJson(description, "test");
  }
  friend std::ostream& operator<<(std::ostream& out, const Variant& v) {
    return out << v.word << (v.incremental ? "Incremental" : "");
  }
};

std::vector<Variant> Variants() {
  std::vector<Variant> variants;
  for (const SolverEntry& entry : SolverRegistry()) {
    variants.push_back({entry.word});
    if (entry.samples) variants.push_back({entry.word, true});
  }
  return variants;
}

/// Returns the bytes of the trace without its times.
std::vector<std::uint8_t> Timeless(std::vector<IterationRecord> history) {
  for (IterationRecord& record : history) record.elapsed_us = 0;
  return EncodeTrace(history);
}

class Repetition : public ::testing::TestWithParam<Variant> {
 protected:
  static void ExpectSame(const SolveOutcome& a, const SolveOutcome& b) {
    EXPECT_EQ(a.status, b.status);
    EXPECT_EQ(a.iterations, b.iterations);
    EXPECT_EQ(a.restarts, b.restarts);
    EXPECT_EQ(a.cost, b.cost);
    EXPECT_EQ(a.max_violation, b.max_violation);
    ASSERT_EQ(a.waypoints.size(), b.waypoints.size());
    for (size_t w = 0; w < a.waypoints.size(); ++w) EXPECT_EQ(a.waypoints[w], b.waypoints[w]) << w;
    ASSERT_EQ(a.history.size(), b.history.size());
    EXPECT_EQ(Timeless(a.history), Timeless(b.history));
  }
};

TEST_P(Repetition, SameJobSameBits) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  for (const char* collision : {"solid", "surface"}) {
    const Method method = GetParam().Make(collision);
    ProblemSolver used(dataset);
    used.Solve(Task::kPosture, dataset->problems(Task::kPosture).back().id, Initialization::kGood, method, {});
    for (const Task task : {Task::kPosture, Task::kMotion}) {
      const int id = dataset->problems(task).front().id;
      ProblemSolver fresh(dataset);
      const SolveOutcome first = fresh.Solve(task, id, Initialization::kInCollision, method, {});
      const SolveOutcome second = used.Solve(task, id, Initialization::kInCollision, method, {});
      EXPECT_FALSE(first.history.empty());
      ExpectSame(first, second);
    }
  }
}

// A program caches nearest features of shapes; a solver clears this cache.
TEST_P(Repetition, SolveDependsOnlyOnItsStart) {
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-small");
  const Stance& stance = dataset->problems(Task::kPosture).front().stances.front();
  CollisionQuery query(dataset->collision_model());
  const auto program = MakeTaskProgram(Task::kPosture, *dataset, query, {&stance, 1}, {});
  const std::unique_ptr<Solver> solver = MakeSolver(GetParam().Make("solid"));
  const auto solve = [&](Initialization initialization) {
    Eigen::VectorXd x = InitialGuess(*dataset, stance, initialization);
    std::mt19937_64 generator(3);
    solver->Solve(*program, x, {{}, &generator, nullptr});
    return x;
  };
  const Eigen::VectorXd first = solve(Initialization::kGood);
  EXPECT_NE(solve(Initialization::kInCollision), first);
  EXPECT_EQ(solve(Initialization::kGood), first);
}

INSTANTIATE_TEST_SUITE_P(Solvers, Repetition, ::testing::ValuesIn(Variants()),
                         [](const auto& variant) { return ::testing::PrintToString(variant.param); });

}  // namespace
}  // namespace legopt
