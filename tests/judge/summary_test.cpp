#include "legopt/judge/summary.h"

#include <gtest/gtest.h>

#include <cmath>

namespace legopt {
namespace {

JudgedSolution Judged(const std::string& method, Verdict literal, Verdict strict, double cost, double time_s) {
  JudgedSolution solution{.method = method, .problem_id = 0, .time_s = time_s, .evaluation = {}};
  solution.evaluation.literal = literal;
  solution.evaluation.strict = strict;
  if (literal == Verdict::kSuccess) solution.evaluation.cost = cost;
  solution.evaluation.num_waypoints = 2;
  return solution;
}

TEST(Summary, MeansOverSolvedProblemsPerWaypoint) {
  const std::vector<JudgedSolution> solutions = {
      Judged("SQP", Verdict::kSuccess, Verdict::kSuccess, 10, 4),
      Judged("Adam", Verdict::kCom, Verdict::kCom, 0, 100),
      Judged("SQP", Verdict::kSuccess, Verdict::kSelfCollision, 20, 8),
      Judged("SQP", Verdict::kFootPose, Verdict::kFootPose, 0, 1000),
  };
  const auto literal = Summarize(solutions, Rule::kLiteral);
  ASSERT_EQ(literal.size(), 2u);
  EXPECT_EQ(literal[0].method, "SQP");
  EXPECT_EQ(literal[0].num_problems, 3);
  EXPECT_EQ(literal[0].num_solved, 2);
  EXPECT_EQ(literal[0].mean_cost, 15);
  EXPECT_EQ(literal[0].mean_time_s, 3);
  EXPECT_EQ(literal[1].num_problems, 1);
  EXPECT_EQ(literal[1].num_solved, 0);
  EXPECT_TRUE(std::isnan(literal[1].mean_cost)) << "nothing solved is a dash, not 0";
  EXPECT_TRUE(std::isnan(literal[1].mean_time_s));
  const auto strict = Summarize(solutions, Rule::kStrict);
  EXPECT_EQ(strict[0].num_solved, 1);
  EXPECT_EQ(strict[0].mean_cost, 10);
}

TEST(Summary, UntimedSolutionsLeaveTheOthersMean) {
  const std::vector<JudgedSolution> solutions = {
      Judged("SQP", Verdict::kSuccess, Verdict::kSuccess, 10, 4),
      Judged("SQP", Verdict::kSuccess, Verdict::kSuccess, 30, std::nan("")),
  };
  const auto rows = Summarize(solutions, Rule::kLiteral);
  EXPECT_EQ(rows[0].mean_cost, 20);
  EXPECT_EQ(rows[0].mean_time_s, 2);
}

TEST(Summary, PosedProblemsWithoutASolutionCountAsNotSolved) {
  std::vector<JudgedSolution> solutions = {Judged("SQP", Verdict::kSuccess, Verdict::kSuccess, 10, 4),
                                           Judged("SQP", Verdict::kCom, Verdict::kCom, 0, 4),
                                           Judged("Adam", Verdict::kSuccess, Verdict::kSuccess, 30, 8)};
  solutions[0].problem_id = 7;
  solutions[0].other_definition = true;
  solutions[1].problem_id = 3;
  solutions[1].other_definition = true;
  solutions[2].problem_id = 3;
  const std::vector<int> posed = {3, 5, 7, 9};
  const auto rows = Summarize(solutions, Rule::kLiteral, posed);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0].num_problems, 4);
  EXPECT_EQ(rows[0].num_solved, 1);
  EXPECT_EQ(rows[0].num_other_definition, 1) << "of the solved ones";
  EXPECT_EQ(rows[0].missing, (std::vector<int>{5, 9}));
  EXPECT_EQ(rows[0].mean_cost, 10);
  EXPECT_EQ(rows[1].num_problems, 4);
  EXPECT_EQ(rows[1].num_other_definition, 0);
  EXPECT_EQ(rows[1].missing, (std::vector<int>{5, 7, 9}));
}

TEST(Summary, NothingGivesNoRows) { EXPECT_TRUE(Summarize({}, Rule::kLiteral).empty()); }

}  // namespace
}  // namespace legopt
