// No heap allocation in the inner loops: a repeated solve of a problem allocates the same number of blocks for any
// number of iterations.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/dataset/test_data.h"
#include "tests/solvers/heap_count.h"
#include "tests/solvers/methods/iterations_key.h"

namespace legopt {
namespace {

struct Variant {
  std::string word;
  bool sampled = false;

  /// Creates a method that never ends early by success.
  Method Make(int max_iterations) const {
    nlohmann::json description = {{"solver", word},
                                  {"options",
                                   {{test::IterationsKey(word), max_iterations},
                                    {"constraint_tolerance", 1e-12},
                                    {"max_penalty_iterations", 2}}}};
    if (word == "best") {
      description["options"]["rescues"] = 0;
      description["options"]["refinements"] = 0;
      description["options"]["free_iterations"] = max_iterations;
      description["options"]["min_approx_improve_frac"] = 1e-6;
      description["options"]["window_improve_frac"] = 1e-6;
    }
    if (sampled) description.update({{"sample_size", 80}, {"incremental", true}});
    return Method::FromJson(description, "test");
  }
  friend std::ostream& operator<<(std::ostream& out, const Variant& v) {
    return out << v.word << (v.sampled ? "Incremental" : "");
  }
};

/// Returns all solvers except Ipopt, whose iterations are external code.
std::vector<Variant> Variants() {
  std::vector<Variant> variants;
  for (const SolverEntry& entry : SolverRegistry()) {
    if (entry.word == "ipopt") continue;
    variants.push_back({entry.word});
    if (entry.samples) variants.push_back({entry.word, true});
  }
  return variants;
}

class Allocations : public ::testing::TestWithParam<Variant> {
 protected:
  struct Count {
    int iterations = 0;
    long blocks = 0;
  };

  /// Counts allocations of the second solve with the given number of iterations per penalty.
  static Count SecondSolve(Program& program, const Eigen::VectorXd& start, int max_iterations) {
    const std::unique_ptr<Solver> solver = MakeSolver(GetParam().Make(max_iterations));
    Count count;
    for (int solve = 0; solve < 2; ++solve) {
      Eigen::VectorXd x = start;
      std::mt19937_64 generator(3);
      const SolverContext context{{}, &generator, nullptr};
      const long before = test::HeapCount();
      count.iterations = solver->Solve(program, x, context).iterations;
      count.blocks = test::HeapCount() - before;
    }
    return count;
  }

  static void ExpectIndependentOfIterations(Program& program, const Eigen::VectorXd& start) {
    const Count full = SecondSolve(program, start, 20);
    const Count brief = SecondSolve(program, start, 1);
    EXPECT_GT(full.iterations, brief.iterations + 3);
    EXPECT_EQ(full.blocks, brief.blocks) << full.iterations << " iterations against " << brief.iterations;
    // LegOpt-best begins a window with an additional descent.
    const int descents = GetParam().word == "best" && program.num_waypoints() > 1 ? 2 : 1;
    EXPECT_LE(full.blocks, descents * kOnce);
  }

  static void ExpectIndependentOfIterations(const std::filesystem::path& folder) {
    const auto dataset = Dataset::Load(folder);
    CollisionQuery query(dataset->collision_model());
    const Stance& stance = dataset->problem(Task::kPosture, 0).stances.front();
    const auto posture = MakeTaskProgram(Task::kPosture, *dataset, query, {&stance, 1}, {});
    const auto window = MakeTaskProgram(Task::kMotion, *dataset, query, std::vector{stance, stance}, {});
    for (const Initialization initialization : {Initialization::kGood, Initialization::kInCollision}) {
      const Eigen::VectorXd start = InitialGuess(*dataset, stance, initialization);
      ExpectIndependentOfIterations(*posture, start);
      Eigen::VectorXd all = start.replicate(window->num_waypoints(), 1);
      for (Eigen::Index t = 0; t < window->num_waypoints(); ++t) all[t * start.size()] += 0.05 * static_cast<double>(t);
      ExpectIndependentOfIterations(*window, all);
    }
  }

  static constexpr long kOnce = 30;  // per descent: TermSampler::Reset lists the terms
};

TEST(HeapCount, SeesWhatItIsMeantToSee) {
  if (test::HeapCount() < 0) GTEST_SKIP() << "the sanitizer's heap is not counted";
  const long before = test::HeapCount();
  Eigen::VectorXd eigen(100);
  eigen.setOnes();
  EXPECT_GT(test::HeapCount(), before) << eigen.sum();
  const long between = test::HeapCount();
  std::vector<double> standard(100, 1.0);
  EXPECT_GT(test::HeapCount(), between) << standard.back();
}

TEST_P(Allocations, DoNotDependOnTheNumberOfIterations) {
  if (test::HeapCount() < 0) GTEST_SKIP() << "the sanitizer's heap is not counted";
  test::TemporaryFolder temporary;
  const test::SyntheticFolder folder(temporary.path() / "dataset");
  ExpectIndependentOfIterations(folder.path());
}

TEST_P(Allocations, DoNotDependOnTheNumberOfIterationsOnAtlas) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  if (test::HeapCount() < 0) GTEST_SKIP() << "the sanitizer's heap is not counted";
  ExpectIndependentOfIterations(test::LegOptFolder());
}

INSTANTIATE_TEST_SUITE_P(Solvers, Allocations, ::testing::ValuesIn(Variants()),
                         [](const auto& variant) { return ::testing::PrintToString(variant.param); });

}  // namespace
}  // namespace legopt
