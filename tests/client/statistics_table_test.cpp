// Policy: the unit is the problem. Failures are charged, missing results are not counted, and contended times are
// replaced by CPU times. Every format has the same rows, and no infinite figure becomes a number.
#include "client/compare/statistics_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "client/client_error.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/sqp_options.h"
#include "toy_experiment.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

const BenchmarkColumn kToyColumn = {Task::kPosture, Initialization::kGood};

StatisticsTable TableOf(const TestExperiment& experiment, const TableSelection& selection = {},
                        std::optional<double> charge_ms = {}) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "test.sqlite").string();
  WriteTestDatabase(file, experiment);
  const auto source = OpenResults({file, {}});
  return ReadStatisticsTable(*source, selection, charge_ms);
}

CellStatistics CellOf(const StatisticsTable& table, std::size_t row) { return table.rows.at(row).cells.at(kToyColumn); }

TEST(StatisticsTable, WhoFailsMostIsLast) {
  const StatisticsTable table = TableOf(ToyPool());
  EXPECT_DOUBLE_EQ(CellOf(table, 0).par10_ms.value(), 203.0);
  EXPECT_DOUBLE_EQ(CellOf(table, 1).par10_ms.value(), 204.6);
  EXPECT_DOUBLE_EQ(CellOf(table, 2).par10_ms.value(), 402.0);
  EXPECT_DOUBLE_EQ(CellOf(table, 0).ert_ms.value(), 28.75);
  EXPECT_DOUBLE_EQ(CellOf(table, 1).ert_ms.value(), 30.75);
  EXPECT_DOUBLE_EQ(CellOf(table, 2).ert_ms.value(), 70.0);
}

// Methods as this program stores them, and as another program may have stored one.
TEST(StatisticsTable, StartsInsideOfAnAttemptStandInTheMethodsOptions) {
  TestExperiment experiment = ToyPool();
  experiment.methods[0].options = Method::Of("best").ToJson().dump();
  experiment.methods[1].options = Method::Of("sqp").ToJson().dump();
  experiment.methods[2].options = "{no JSON}";
  const StatisticsTable table = TableOf(experiment);
  EXPECT_EQ(table.rows[0].method.inner_starts, BestOptions().rescues);
  EXPECT_EQ(table.rows[1].method.inner_starts, 0);
  EXPECT_EQ(table.rows[2].method.inner_starts, 0);
}

// With an effort limit, the wall-time limit of hours is only a safety net. The charge depends on the problem alone, so
// a slow method changes no figure of another.
TEST(StatisticsTable, WhereEffortIsLimitedAFailureIsChargedByWaypoint) {
  TestExperiment experiment = ToyPool();
  experiment.effort_limit = 1000;
  for (const int waypoints : {1, 3}) {
    experiment.num_waypoints = waypoints;
    const StatisticsTable table = TableOf(experiment);
    EXPECT_EQ(table.columns.at(kToyColumn).charge.rule, ChargeRule::kPerWaypoint);
    EXPECT_DOUBLE_EQ(table.columns.at(kToyColumn).charge.ms, 10'000.0);
    EXPECT_DOUBLE_EQ(CellOf(table, 0).par10_ms.value(), 3.0 + waypoints * 2000.0);
    EXPECT_THAT(RenderStatisticsTable(table, TableFormat::kText, {.layout = {}}),
                HasSubstr("A failure is charged 10000 ms for each waypoint of the problem."));
  }
  experiment.num_waypoints = 1;
  const double before = CellOf(TableOf(experiment), 0).par10_ms.value();
  experiment.methods.push_back({"slow"});
  AddTimes(3, {9000, 9000, 9000, 9000, 9000}, &experiment);
  EXPECT_EQ(CellOf(TableOf(experiment), 0).par10_ms.value(), before);
}

TEST(StatisticsTable, WithoutALimitOfEffortTheWallLimitIsCharged) {
  TestExperiment experiment;
  experiment.results = {{.problem = 0, .verdict = "com"}};
  const StatisticsTable table = TableOf(experiment);
  EXPECT_EQ(table.columns.at(kToyColumn).charge.rule, ChargeRule::kWallLimit);
  EXPECT_DOUBLE_EQ(CellOf(table, 0).par10_ms.value(), 10'000.0);
}

TEST(StatisticsTable, AChargeMayBeChosen) {
  const StatisticsTable table = TableOf(ToyPool(), {}, 50.0);
  EXPECT_DOUBLE_EQ(CellOf(table, 0).par10_ms.value(), 13.0);
  const std::string text = RenderStatisticsTable(table, TableFormat::kText);
  EXPECT_THAT(text, testing::AllOf(HasSubstr("Charged"), HasSubstr("A failure is charged 50.0 ms, as chosen.")));
  const auto column = nlohmann::json::parse(RenderStatisticsTable(table, TableFormat::kJson)).at("columns")[0];
  EXPECT_EQ(column.at("charge_ms"), 50.0);
  EXPECT_EQ(column.at("charge_rule"), "chosen");
}

// Ranks 1 2 3, 2 1 3, 2 3 1, 2 1 3 and 2.5 1 2.5, computed by hand.
TEST(StatisticsTable, FriedmanIsShownWithImanAndDavenport) {
  const StatisticsTable table = TableOf(ToyPool());
  const double chi_square = 2.1 / 0.95;
  const auto& ranks = table.columns.at(kToyColumn).ranks;
  ASSERT_TRUE(ranks.has_value());
  EXPECT_NEAR(ranks->chi_square, chi_square, 1e-12);
  EXPECT_NEAR(ranks->iman_davenport.f, 4 * chi_square / (10 - chi_square), 1e-12);
  EXPECT_THAT(RenderStatisticsTable(table, TableFormat::kText),
              testing::AllOf(HasSubstr("Friedman's chi-square 2.21, 2 degrees"), HasSubstr("F 1.14, 2 and 8 degrees")));
  const auto column = nlohmann::json::parse(RenderStatisticsTable(table, TableFormat::kJson)).at("columns")[0];
  EXPECT_NEAR(column.at("friedman_chi_square"), chi_square, 1e-12);
  EXPECT_NEAR(column.at("iman_davenport_f"), ranks->iman_davenport.f, 1e-12);
  EXPECT_GT(column.at("iman_davenport_p").get<double>(), 0.05);
  EXPECT_FALSE(TableOf(Discordant(3, 1, 1, 0)).columns.at(kToyColumn).ranks.has_value()) << "two are Wilcoxon's";
}

// Best times 1 1 2 4 16; the profile of a method that is never the best begins at 0.
TEST(StatisticsTable, ProfilesAreStepsFromRatioOne) {
  TestExperiment experiment = ToyPool();
  experiment.methods.push_back({"D"});
  AddTimes(3, {10, 10, 10, 40, std::nullopt}, &experiment);
  const StatisticsTable table = TableOf(experiment);
  const auto steps = nlohmann::json::parse(RenderProfiles(table, TableFormat::kJson));
  std::vector<std::tuple<std::string, double, double>> found;
  for (const auto& step : steps) {
    EXPECT_EQ(step.at("problems"), 5);
    found.emplace_back(step.at("method"), step.at("ratio"), step.at("share"));
  }
  EXPECT_THAT(found,
              testing::ElementsAre(std::tuple("A", 1.0, 0.2), std::tuple("A", 2.0, 0.8), std::tuple("B", 1.0, 0.6),
                                   std::tuple("B", 2.0, 0.8), std::tuple("C", 1.0, 0.2), std::tuple("C", 4.0, 0.6),
                                   std::tuple("D", 1.0, 0.0), std::tuple("D", 5.0, 0.2), std::tuple("D", 10.0, 0.8)));
  EXPECT_THAT(RenderProfiles(table, TableFormat::kCsv),
              testing::StartsWith("experiment_id,method_id,method,multi_starts,inner_starts,sample_size,incremental,"
                                  "collision,task,initialization,measure,problems,ratio,share\n"));
  EXPECT_THAT(RenderProfiles(table, TableFormat::kLatex), HasSubstr("\\midrule"));
}

TEST(StatisticsTable, QuantilesCountFailuresAsInfinite) {
  const StatisticsTable table = TableOf(ToyPool());
  EXPECT_DOUBLE_EQ(CellOf(table, 0).time_median_ms.value(), 4.0);
  EXPECT_TRUE(std::isinf(CellOf(table, 0).time_q95_ms.value()));
  EXPECT_DOUBLE_EQ(CellOf(table, 2).time_median_ms.value(), 4.0);
}

TEST(StatisticsTable, CommonMeansAreOverWhatAllSolved) {
  const StatisticsTable table = TableOf(ToyPool());
  EXPECT_EQ(table.columns.at(kToyColumn).common, 2);  // problems 0 and 1
  EXPECT_NEAR(CellOf(table, 0).common_time_ms.value(), std::sqrt(2.0 * 3.0) - 1.0, 1e-12);
  EXPECT_NEAR(CellOf(table, 2).common_time_ms.value(), 4.0, 1e-12);
  EXPECT_DOUBLE_EQ(CellOf(table, 0).common_cost.value(), 400.0);
}

TEST(StatisticsTable, WilsonAndCochranAsPublished) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"C"}};
  const std::vector<std::string> rows = {"110", "110", "010", "111", "010", "110", "100", "111", "010", "110"};
  for (int method = 0; method < 3; ++method) {
    std::vector<std::optional<double>> times;
    for (const std::string& row : rows) {
      times.push_back(row[static_cast<std::size_t>(method)] == '1' ? std::optional(1.0) : std::nullopt);
    }
    AddTimes(method, times, &experiment);
  }
  const StatisticsTable table = TableOf(experiment);
  const auto& test = table.columns.at(kToyColumn).success;
  ASSERT_TRUE(test.has_value());
  EXPECT_NEAR(test->q, 9.75, 1e-12);
  EXPECT_NEAR(test->p, 0.007635, 5e-7);
  TestExperiment large;
  large.methods = {{"A"}};
  std::vector<std::optional<double>> times(50, 1.0);
  times[7] = std::nullopt;
  AddTimes(0, times, &large);
  const CellStatistics cell = CellOf(TableOf(large), 0);
  EXPECT_NEAR(cell.share.lower, 0.895046, 5e-7);
  EXPECT_NEAR(cell.share.upper, 0.996461, 5e-7);
}

TEST(StatisticsTable, QueuedIsMissingAndDeadIsAFailure) {
  TestExperiment experiment;
  experiment.results = {{.problem = 0}, {.problem = 1, .finished = false}, {.problem = 2, .dead = true}};
  const CellStatistics cell = CellOf(TableOf(experiment), 0);
  EXPECT_EQ(cell.n, 2);
  EXPECT_EQ(cell.missing, 1);
  EXPECT_DOUBLE_EQ(cell.solved, 1.0);
  EXPECT_EQ(cell.runs, 2);
  EXPECT_EQ(cell.reported, 1);
  EXPECT_DOUBLE_EQ(cell.par10_ms.value(), (1.5 + 10'000.0) / 2);
}

TEST(StatisticsTable, RepetitionsAreAveragedBeforeAnythingElse) {
  TestExperiment experiment;
  experiment.results = {{.problem = 0, .wall_us = 1000},
                        {.problem = 0, .verdict = "com", .wall_us = 5000, .repetition = 1},
                        {.problem = 1, .wall_us = 3000},
                        {.problem = 1, .wall_us = 5000, .repetition = 1}};
  const StatisticsTable table = TableOf(experiment);
  EXPECT_EQ(table.repetitions, 2);
  const CellStatistics cell = CellOf(table, 0);
  EXPECT_EQ(cell.n, 2) << "problems, not jobs";
  EXPECT_EQ(cell.runs, 4);
  EXPECT_DOUBLE_EQ(cell.solved, 1.5);
  EXPECT_DOUBLE_EQ(cell.time_median_ms.value(), 2.5);  // median of 1 and 4
  EXPECT_DOUBLE_EQ(cell.par10_ms.value(), ((1.0 + 10'000.0) / 2 + 4.0) / 2);
  EXPECT_EQ(cell.solved_least.value(), 1) << "the second repetition";
  EXPECT_EQ(cell.solved_most.value(), 2);
  EXPECT_THAT(RenderStatisticsTable(table, TableFormat::kText),
              testing::AllOf(HasSubstr("1.5/2"), HasSubstr("2 repetitions averaged per problem"), HasSubstr("Seeds"),
                             HasSubstr("1 - 2")));
  EXPECT_FALSE(CellOf(TableOf(ToyPool()), 0).solved_least.has_value()) << "one run per problem";
}

TEST(StatisticsTable, TimesAreCpuTimesAndContendedRunsAreCounted) {
  TestExperiment experiment;
  experiment.results = {{.problem = 0, .wall_us = 9000, .cpu_us = 2000},
                        {.problem = 1, .wall_us = 2200, .cpu_us = 2000},
                        {.problem = 2, .wall_us = 2200, .cpu_us = 2000, .switches = 1},
                        {.problem = 3, .wall_us = 2000, .status = SolveStatus::kIterationLimit}};
  const CellStatistics cell = CellOf(TableOf(experiment), 0);
  EXPECT_EQ(cell.reported, 4);
  EXPECT_EQ(cell.contended, 2);
  EXPECT_EQ(cell.stopped, 1);
  EXPECT_DOUBLE_EQ(cell.time_median_ms.value(), 2.0);
  EXPECT_DOUBLE_EQ(cell.cpu_ms, 8.0);
}

TEST(StatisticsTable, RanksAndProfilesAreByWorkWhereAllOfItWasCounted) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"C"}};
  for (int method = 0; method < 3; ++method) {
    for (int problem = 0; problem < 4; ++problem) {  // the less work, the more time
      experiment.results.push_back(
          {.method = method, .problem = problem, .wall_us = 9000 - 1000 * method, .work_ns = 1'000'000 * (method + 1)});
    }
  }
  const StatisticsTable table = TableOf(experiment);
  EXPECT_TRUE(table.columns.at(kToyColumn).by_work);
  EXPECT_DOUBLE_EQ(CellOf(table, 0).mean_rank.value(), 1.0);
  EXPECT_DOUBLE_EQ(CellOf(table, 2).work_median_ms.value(), 3.0);
  EXPECT_DOUBLE_EQ(CellOf(table, 2).work_ratio.value(), 3.0);
  EXPECT_THAT(RenderStatisticsTable(table, TableFormat::kText),
              testing::AllOf(HasSubstr("Work median"), HasSubstr("In ranks by work?")));
  experiment.results.back().work_ns = 0;
  const StatisticsTable partly = TableOf(experiment);
  EXPECT_FALSE(partly.columns.at(kToyColumn).by_work);
  EXPECT_DOUBLE_EQ(CellOf(partly, 0).mean_rank.value(), 3.0);
  EXPECT_FALSE(CellOf(partly, 2).work_median_ms.has_value());
  EXPECT_FALSE(CellOf(partly, 2).work_ratio.has_value());
}

/// Four runs of A: violations 1e-4, 3e-4 (only by the solid rule) and 0, and one failure by 5e-2. Distances that are
/// not violations are larger, as is a violation that does not count for datasets of format 1.
TestExperiment ToyViolations() {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}};
  const Violation touch{Verdict::kTouch, Rule::kSolid, 0, "l_foot", 0.0019};
  const auto feet = [](double value) { return Violation{Verdict::kFootPose, Rule::kLiteral, 0, "l_foot", value}; };
  experiment.results = {{.problem = 0, .violations = {feet(1e-4), touch}, .starts = 1},
                        {.problem = 1,
                         .violations = {feet(5e-5),
                                        touch,
                                        {Verdict::kEnvironmentCollision, Rule::kSolid, 0, "l_foot, floor", 3e-4},
                                        {Verdict::kCom, Rule::kSolid, 0, "", 0.09}},
                         .starts = 5},
                        {.problem = 2, .violations = {feet(0.0), touch}, .starts = 1},
                        {.problem = 3, .verdict = "foot_pose", .violations = {feet(5e-2)}, .starts = 9}};
  for (int problem = 0; problem < 4; ++problem) experiment.results.push_back({.method = 1, .problem = problem});
  return experiment;
}

TEST(StatisticsTable, ToleranceOfSolvedRunsAndStartsOfAllRuns) {
  TableSelection selection;
  selection.rule = Rule::kSolid;
  const StatisticsTable solid = TableOf(ToyViolations(), selection);
  const CellStatistics cell = CellOf(solid, 0);
  EXPECT_DOUBLE_EQ(cell.tolerance_median.value(), 1e-4);
  EXPECT_DOUBLE_EQ(cell.tolerance_largest.value(), 3e-4);
  EXPECT_DOUBLE_EQ(cell.further_starts_mean.value(), (0 + 4 + 0 + 8) / 4.0);
  EXPECT_EQ(cell.further_starts_largest.value(), 8);
  EXPECT_FALSE(CellOf(solid, 1).tolerance_median.has_value()) << "as stored by earlier releases";
  EXPECT_FALSE(CellOf(solid, 1).further_starts_mean.has_value());
  selection.rule = Rule::kLiteral;
  const CellStatistics literal = CellOf(TableOf(ToyViolations(), selection), 0);
  EXPECT_DOUBLE_EQ(literal.tolerance_median.value(), 5e-5);
  EXPECT_DOUBLE_EQ(literal.tolerance_largest.value(), 1e-4);
  EXPECT_THAT(RenderStatisticsTable(solid, TableFormat::kText), HasSubstr("0.300"));
}

TEST(StatisticsTable, MethodsWithoutACellLeaveTheOthersAlone) {
  TestExperiment experiment = ToyPool();
  for (TestResult& result : experiment.results) {
    if (result.method == 2) result.initialization = "in_collision";
  }
  const StatisticsTable table = TableOf(experiment);
  EXPECT_EQ(table.columns.at(kToyColumn).common, 3);
  EXPECT_FALSE(table.columns.at(kToyColumn).success.has_value()) << "two methods are McNemar's";
  EXPECT_EQ(table.rows[2].cells.count(kToyColumn), 0U);
}

TEST(StatisticsTable, EveryFormatHasEveryMethod) {
  const StatisticsTable table = TableOf(ToyPool());
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    const std::string text = RenderStatisticsTable(table, format);
    EXPECT_THAT(text, testing::AllOf(HasSubstr("PAR10"), HasSubstr("inf"), HasSubstr("402"), HasSubstr("Cochran")));
  }
  const auto json = nlohmann::json::parse(RenderStatisticsTable(table, TableFormat::kJson));
  ASSERT_EQ(json.at("rows").size(), 3U);
  EXPECT_EQ(json.at("rows")[2].at("par10_ms"), 402.0);
  EXPECT_TRUE(json.at("rows")[2].at("time_q95_ms").is_null());
  EXPECT_EQ(json.at("columns")[0].at("common"), 2);
  const std::string csv = RenderStatisticsTable(table, TableFormat::kCsv);
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  EXPECT_THAT(csv, testing::StartsWith("experiment_id,method_id,method,"));
}

TEST(StatisticsTable, WhatTheClockEndedIsWarnedOf) {
  TestExperiment experiment;
  experiment.results = {{.problem = 0}, {.problem = 1, .verdict = "com", .status = SolveStatus::kTimeLimit}};
  const StatisticsTable table = TableOf(experiment);
  EXPECT_EQ(table.clock_stopped, 1);
  EXPECT_THAT(RenderStatisticsTable(table, TableFormat::kText), HasSubstr("The clock ended 1 job"));
  EXPECT_THAT(RenderStatisticsTable(TableOf(ToyPool()), TableFormat::kText), testing::Not(HasSubstr("The clock")));
}

TEST(StatisticsTable, ACollisionModelThatNobodyHasIsRefused) {
  EXPECT_THROW(TableOf(ToyPool(), {.experiment = 1, .filter = {.collision = SceneRepresentation::kSurface}}),
               ClientError);
}

}  // namespace
}  // namespace legopt::client
