// No heap in the inner loops: a solve by a solver that has solved the problem before asks for as many blocks however
// many iterations it takes.

#include <gtest/gtest.h>

#include <vector>

#include "legopt/optimize/sqp_solver.h"
#include "legopt/problem/initial_guess.h"
#include "legopt/problem/waypoint_program.h"
#include "tests/optimize/heap_count.h"
#include "tests/problem/synthetic_dataset.h"
#include "tests/problem/test_data.h"

namespace legopt {
namespace {

class Allocations : public ::testing::TestWithParam<Sampling> {
 protected:
  struct Count {
    int iterations = 0;
    long blocks = 0;
  };

  /// Of the second solve with the given number of convexifications per penalty. No solve ends early by success.
  static Count SecondSolve(Program& program, const Eigen::VectorXd& start, int max_iterations) {
    SqpOptions options;
    options.max_iterations = max_iterations;
    options.constraint_tolerance = 1e-12;
    options.max_penalty_iterations = 2;
    SqpSolver solver(options, GetParam());
    Count count;
    for (int solve = 0; solve < 2; ++solve) {
      Eigen::VectorXd x = start;
      std::mt19937_64 generator(3);
      const SolverContext context{{}, &generator, nullptr};
      const long before = test::HeapCount();
      count.iterations = solver.Solve(program, x, context).iterations;
      count.blocks = test::HeapCount() - before;
    }
    return count;
  }

  static void ExpectIndependentOfIterations(const std::filesystem::path& folder) {
    const auto dataset = Dataset::Load(folder);
    CollisionQuery query(dataset->collision_model());
    const Stance& stance = dataset->problem(Task::kPosture, 0).stances.front();
    const auto program = WaypointProgram::Posture(*dataset, query, stance, {});
    for (const Initialization initialization : {Initialization::kGood, Initialization::kInCollision}) {
      const Eigen::VectorXd start = InitialGuess(*dataset, stance, initialization);
      const Count brief = SecondSolve(*program, start, 1);
      const Count full = SecondSolve(*program, start, 20);
      EXPECT_GT(full.iterations, brief.iterations + 3);
      EXPECT_EQ(full.blocks, brief.blocks) << full.iterations << " iterations against " << brief.iterations;
      EXPECT_LE(full.blocks, kSampler);
    }
  }

  static constexpr long kSampler = 30;  // TermSampler::Reset lists the terms
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

INSTANTIATE_TEST_SUITE_P(Samplings, Allocations, ::testing::Values(Sampling{100, false}, Sampling{80, true}),
                         [](const auto& sampling) { return sampling.param.incremental ? "Incremental" : "All"; });

}  // namespace
}  // namespace legopt
