// The posture benchmark on real input: Atlas in the reconstructed garage, judged by the original evaluator's rule.

#include <gtest/gtest.h>

#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

class LegOptPostures : public ::testing::Test {
 protected:
  struct Row {
    int solved = 0;
    double mean_cost = 0.0;
  };

  static Row Run(int multi_starts, Initialization start) {
    Method method;
    method.multi_starts = multi_starts;
    return Run(method, start);
  }

  static Row Run(const Method& method, Initialization start) {
    const auto dataset = Dataset::Load(test::LegOptFolder());
    Judge judge(dataset);
    ProblemSolver solver(dataset);
    Row row;
    for (const ProblemDefinition& problem : dataset->problems(Task::kPosture)) {
      const SolveOutcome outcome = solver.Solve(Task::kPosture, problem.id, start, method, {});
      const Evaluation evaluation = judge.Evaluate(Task::kPosture, problem, outcome.waypoints);
      if (evaluation.literal != Verdict::kSuccess) {
        std::printf("problem %d, %s: %s; solver %s %s\n", problem.id, std::string(ToString(start)).c_str(),
                    evaluation.detail.c_str(), std::string(ToString(outcome.status)).c_str(), outcome.message.c_str());
        continue;
      }
      ++row.solved;
      row.mean_cost += evaluation.cost;
    }
    row.mean_cost /= std::max(row.solved, 1);
    std::printf("%d solved, mean cost %.1f\n", row.solved, row.mean_cost);
    return row;
  }
};

constexpr double kMaxMeanCost = 420.0;

TEST_F(LegOptPostures, PlainSqp) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
    const Row row = Run(0, start);
    EXPECT_GE(row.solved, 34);
    EXPECT_LE(row.mean_cost, kMaxMeanCost);
  }
}

TEST_F(LegOptPostures, SqpWithRestarts) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  for (const Initialization start : {Initialization::kGood, Initialization::kInCollision}) {
    const Row row = Run(10, start);
    EXPECT_EQ(row.solved, 35);
    EXPECT_LE(row.mean_cost, kMaxMeanCost);
  }
}

TEST_F(LegOptPostures, Ipopt) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const Row row = Run(Method::Of("ipopt"), Initialization::kGood);
  EXPECT_GE(row.solved, 34);
  EXPECT_LE(row.mean_cost, kMaxMeanCost);
}

TEST_F(LegOptPostures, IpoptFromInCollision) {
  LEGOPT_SKIP_WITHOUT_TEST_DATA();
  const Row row = Run(Method::Of("ipopt"), Initialization::kInCollision);
  EXPECT_GE(row.solved, 34);
  EXPECT_LE(row.mean_cost, kMaxMeanCost);
}

}  // namespace
}  // namespace legopt
