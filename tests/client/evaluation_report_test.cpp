// Policy: `evaluate` reports what the judge says, per method and per failure, and warns where the file claims
// otherwise.
#include "client/evaluation_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/problem/dataset.h"
#include "table_parsers.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

// A judged file without a judge: the rendering only.
EvaluationReport Example() {
  Evaluation good{};
  good.literal = good.strict = Verdict::kSuccess;
  good.cost = 396.4;
  good.num_waypoints = 1;
  Evaluation bad = good;
  bad.literal = bad.strict = Verdict::kFootPose;
  bad.failed_waypoint = 0;
  bad.detail = "l_foot is 0.002 m off";
  bad.cost = std::nan("");
  EvaluationReport report;
  report.rows = {{"A", 0, 0.002, good, false}, {"A", 1, 0.004, bad, true}, {"B", 0, 0.001, bad, false}};
  report.summaries = {{"A", 2, 1, 396.4, 0.002}, {"B", 1, 0, std::nan(""), std::nan("")}};
  report.warnings = {"problem 1, A: the file says success, the judge says foot_pose"};
  return report;
}

TEST(EvaluationReport, TextShowsSummaryAndFailures) {
  const std::string text = RenderEvaluation(Example(), ListingFormat::kText);
  EXPECT_THAT(text, HasSubstr("A       1/2      396   2.00"));
  EXPECT_THAT(text, HasSubstr("B       0/1      -     -"));
  EXPECT_THAT(text, HasSubstr("time (ms)"));
  EXPECT_THAT(text, HasSubstr("l_foot is 0.002 m off"));
}

TEST(EvaluationReport, CsvHoldsTheSummaryUnrounded) {
  const auto rows = ParseCsv(RenderEvaluation(Example(), ListingFormat::kCsv));
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[1], (std::vector<std::string>{"A", "2", "1", "396.4", "0.002"}));
  EXPECT_EQ(rows[2], (std::vector<std::string>{"B", "1", "0", "", ""}));
}

TEST(EvaluationReport, JsonHoldsEverySolution) {
  const auto json = nlohmann::json::parse(RenderEvaluation(Example(), ListingFormat::kJson));
  EXPECT_EQ(json.at("methods")[0].at("solved"), 1);
  ASSERT_EQ(json.at("solutions").size(), 3U);
  EXPECT_EQ(json.at("solutions")[1].at("verdict_literal"), "foot_pose");
  EXPECT_TRUE(json.at("solutions")[1].at("cost").is_null());
  EXPECT_EQ(json.at("solutions")[1].at("claim_differs"), true);
  EXPECT_EQ(json.at("warnings").size(), 1U);
}

TEST(EvaluationReport, SampleSolutionIsJudgedAsPublished) {
  const std::filesystem::path folder = LEGOPT_TEST_DATA_DIR;
  if (!std::filesystem::exists(folder / "sample_solution.json")) GTEST_SKIP() << "no shared test data in " << folder;
  SolutionFile file = ReadSolutions(folder / "sample_solution.json");
  file.problems.at(0).solutions.at(0).success = false;
  Judge judge(Dataset::Load(folder));
  const auto report = EvaluateSolutions(file, judge, Rule::kLiteral);
  ASSERT_EQ(report.summaries.size(), 1U);
  EXPECT_EQ(report.summaries[0].num_solved, 1);
  EXPECT_NEAR(report.summaries[0].mean_cost, 955.88, 0.01);
  ASSERT_EQ(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("the file says no success, the judge says success"));
}

TEST(EvaluationReport, ForeignDefinitionIsUsedAndReported) {
  const std::filesystem::path folder = LEGOPT_TEST_DATA_DIR;
  if (!std::filesystem::exists(folder / "sample_solution.json")) GTEST_SKIP() << "no shared test data in " << folder;
  SolutionFile file = ReadSolutions(folder / "sample_solution.json");
  file.problems.at(0).definition.stances.at(0).footholds.at(0).position.x() += 0.01;
  Judge judge(Dataset::Load(folder));
  const auto report = EvaluateSolutions(file, judge, Rule::kLiteral);
  EXPECT_EQ(report.rows.at(0).evaluation.literal, Verdict::kFootPose);
  ASSERT_GE(report.warnings.size(), 1U);
  EXPECT_THAT(report.warnings[0], HasSubstr("differs from the dataset's"));
}

}  // namespace
}  // namespace legopt::client
