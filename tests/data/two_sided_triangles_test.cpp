// LegOpt-best with two-sided triangles on a motion of the default dataset: a limb on the wrong side of a triangle is
// held there. From a good start this happens on the path, in collision the limb is on the wrong side from the
// beginning.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/solvers/methods/method.h"
#include "tests/folders.h"

namespace legopt {
namespace {

class TwoSidedTriangles : public ::testing::TestWithParam<Initialization> {};

TEST_P(TwoSidedTriangles, HoldNobodyForGood) {
  constexpr int kMotion = 17;
  const auto dataset = Dataset::Load(SourceFolder() + "/data/garage-easier");
  const auto& motions = dataset->problems(Task::kMotion);
  const auto motion =
      std::ranges::find_if(motions, [](const ProblemDefinition& problem) { return problem.id == kMotion; });
  ASSERT_NE(motion, motions.end());
  const Method method = Method::FromJson({{"solver", "best"}, {"options", {{"collision", "surface"}}}}, "test");
  const SolveOutcome outcome = ProblemSolver(dataset).Solve(Task::kMotion, *motion, GetParam(), method, {});
  const Evaluation evaluation = Judge(dataset).Evaluate(Task::kMotion, *motion, outcome.waypoints);
  EXPECT_EQ(evaluation.literal, Verdict::kSuccess) << evaluation.detail;
  EXPECT_GT(outcome.starts, outcome.windows) << "nobody had to be rescued, so this test tests nothing";
  EXPECT_LT(evaluation.cost, 0.25) << "0.12 - 0.18, with solids 0.1; buried limbs that are dragged along cost 0.3";
}

INSTANTIATE_TEST_SUITE_P(Starts, TwoSidedTriangles,
                         ::testing::Values(Initialization::kGood, Initialization::kInCollision),
                         [](const auto& start) { return std::string(ToString(start.param)); });

}  // namespace
}  // namespace legopt
