// Policy: figures of an unfinished experiment include only problems that all shown rows have completed; without such
// problems there is no figure. Tested with 0, 1 and 2 complete problems for every figure.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "client/client_error.h"
#include "client/compare/comparison_report.h"
#include "client/compare/statistics_table.h"
#include "client/figures/figures.h"
#include "client/page/page_experiment.h"
#include "client/plot/drawing.h"
#include "client/plot/plot.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using Json = nlohmann::ordered_json;
using testing::HasSubstr;
using testing::Not;

const BenchmarkColumn kColumn = {Task::kPosture, Initialization::kGood};

// Returns three methods with `complete` problems finished by all. With `more`, adds three problems that each of them
// has finished partly, and a fourth method that has finished nothing.
TestExperiment Unfinished(int complete, bool more, bool all_solved = false) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"C"}};
  experiment.effort_limit = 1000;
  if (more) experiment.methods.push_back({"waiting"});
  for (int method = 0; method < 3; ++method) {
    for (int problem = 0; problem < complete; ++problem) {
      const bool solved = all_solved || problem == 1 || method != 2;
      experiment.results.push_back({.method = method,
                                    .problem = problem,
                                    .verdict = solved ? "success" : "com",
                                    .cost = 300.0 + 10 * method,
                                    .wall_us = 1000 * (1 + method + problem)});
    }
    for (int problem = 10; more && problem < 13; ++problem) {
      const bool finished = problem - 10 == method;
      experiment.results.push_back({.method = method, .problem = problem, .wall_us = 77'000, .finished = finished});
    }
  }
  for (int problem = 0; more && problem < complete; ++problem) {
    experiment.results.push_back({.method = 3, .problem = problem, .finished = false});
  }
  for (int problem = 10; more && problem < 13; ++problem) {
    experiment.results.push_back({.method = 3, .problem = problem, .finished = false});
  }
  return experiment;
}

struct Figures {
  StatisticsTable table;
  Json statistics, column;
  std::vector<std::string> texts;  // everything printed or drawn
};

Figures FiguresOf(const TestExperiment& experiment) {
  const TemporaryFolder folder;
  const std::string file = (folder.path() / "test.sqlite").string();
  WriteTestDatabase(file, experiment);
  const auto source = OpenResults({file, {}});
  SolvedExperiment solved = ReadCells(*source, {});
  ReadSolves(*source, Rule::kLiteral, &solved);
  Figures figures{ComputeStatistics(solved, Rule::kLiteral), {}, {}, {}};
  figures.statistics = StatisticsTableJson(figures.table);
  std::vector<const SolveCell*> cells;
  for (const SolveCell& cell : solved.cells) cells.push_back(&cell);
  figures.column = DescribeColumn(cells);
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex, TableFormat::kCsv}) {
    figures.texts.push_back(RenderStatisticsTable(figures.table, format));
  }
  for (const auto format : {TableFormat::kText, TableFormat::kCsv}) {
    figures.texts.push_back(RenderProfiles(figures.table, format));
  }
  const Plot profiles = ProfilePlot(figures.table);
  figures.texts.push_back(RenderPlotText(profiles));
  figures.texts.push_back(RenderFigure(profiles, PlotFormat::kSvg));
  ComparisonRequest request;
  request.a = "A";
  request.b = "B";
  request.source = {file, {}};
  try {
    const Comparison comparison = ReadComparison(request);
    figures.texts.push_back(RenderComparison(comparison, TableFormat::kText));
    figures.texts.push_back(ComparisonJson(comparison).dump());
    figures.texts.push_back(RenderPlotText(ScatterPlot(comparison, kMilliseconds)));
    figures.texts.push_back(RenderFigure(ScatterPlot(comparison, kMilliseconds), PlotFormat::kSvg));
  } catch (const ClientError& error) {
    figures.texts.emplace_back(error.what());  // no problem that both have finished
  }
  return figures;
}

class UnfinishedFigures : public testing::TestWithParam<int> {};

TEST_P(UnfinishedFigures, AreThoseOfTheCompleteProblemsAlone) {
  const int complete = GetParam();
  const Figures part = FiguresOf(Unfinished(complete, true));
  EXPECT_EQ(part.table.columns.at(kColumn).complete, complete);
  EXPECT_EQ(part.column.at("complete"), complete);
  if (complete == 0) return;
  const Figures whole = FiguresOf(Unfinished(complete, false));
  for (std::size_t row = 0; row < 3; ++row) {
    Json of_part = part.statistics.at("rows").at(row), of_whole = whole.statistics.at("rows").at(row);
    EXPECT_EQ(of_part.at("missing"), 2);
    for (Json* json : {&of_part, &of_whole}) json->erase("missing");
    EXPECT_EQ(of_part, of_whole);
  }
  Json of_part = part.statistics.at("columns").at(0), of_whole = whole.statistics.at("columns").at(0);
  EXPECT_EQ(of_part.at("left_out"), Json::array({"waiting"}));
  for (Json* json : {&of_part, &of_whole}) json->erase("left_out");
  EXPECT_EQ(of_part, of_whole);
  for (const char* curves : {"efforts", "costs"}) {
    Json drawn = part.column.at(curves);
    EXPECT_TRUE(drawn.back().is_null()) << "the method that waits has no curve";
    drawn.erase(3);
    EXPECT_EQ(drawn, whole.column.at(curves)) << curves;
  }
}

TEST(PageColumn, HasWorkWhereAllOfItWasCountedAndElseTime) {
  TestExperiment experiment = Unfinished(2, false, true);
  for (std::size_t i = 0; i < experiment.results.size(); ++i) {
    experiment.results[i].work_ns = 2'000'000 * static_cast<std::int64_t>(i + 1);
  }
  std::swap(experiment.results.front().work_ns, experiment.results.back().work_ns);
  const Json by_work = FiguresOf(experiment).column;
  EXPECT_EQ(by_work.at("effort"), "work");
  EXPECT_EQ(by_work.at("methods").at(0).at("effort_ms"), Json::array({12.0, 4.0}));
  EXPECT_EQ(by_work.at("methods").at(1).at("effort_ratio"), Json::array({1.0, 4.0}));
  EXPECT_EQ(by_work.at("efforts").at(0).at("x"), Json::array({4.0, 12.0}));
  EXPECT_EQ(by_work.at("profiles").at("effort").at("curves").at(1).at("x"), Json::array({1.0, 4.0}));
  experiment.results.back().work_ns = 0;
  const Json by_time = FiguresOf(experiment).column;
  EXPECT_EQ(by_time.at("effort"), "time");
  EXPECT_EQ(by_time.at("methods").at(0).at("effort_ms"), Json::array({1.0, 2.0}));
}

TEST_P(UnfinishedFigures, StateHowManyProblemsTheyAreOf) {
  const int complete = GetParam();
  const std::string text = FiguresOf(Unfinished(complete, true)).texts.front();
  EXPECT_THAT(text, HasSubstr("n: " + std::to_string(complete) + (complete == 1 ? " problem " : " problems ") +
                              "that all rows have completed."));
  EXPECT_THAT(text, HasSubstr("Left out, without a completed problem: waiting."));
  const int finished = 3 * complete + 3, jobs = 4 * (complete + 3);
  EXPECT_THAT(text, HasSubstr(std::to_string(finished) + "/" + std::to_string(jobs) + " jobs finished"));
  EXPECT_THAT(FiguresOf(Unfinished(2, false)).texts.front(), Not(HasSubstr("jobs finished")));
}

TEST_P(UnfinishedFigures, AreNumbersOrDashes) {
  const std::regex nan("(^|[^a-z])-?nan([^a-z]|$)", std::regex::icase);
  for (const bool more : {true, false}) {
    if (GetParam() == 0 && !more) continue;
    for (const std::string& text : FiguresOf(Unfinished(GetParam(), more)).texts) {
      EXPECT_FALSE(std::regex_search(text, nan)) << text;
    }
  }
}

TEST_P(UnfinishedFigures, NothingIsSaidOfNothing) {
  const Figures figures = FiguresOf(Unfinished(GetParam(), true, true));
  const bool some = GetParam() > 0;
  for (const Json& row : figures.statistics.at("rows")) {
    const bool shown = some && row.at("method") != "waiting";
    EXPECT_EQ(row.at("n"), shown ? GetParam() : 0);
    for (const char* figure :
         {"solved", "share_lower", "share_upper", "time_median_ms", "time_q95_ms", "par10_ms", "ert_ms", "mean_rank",
          "cost_median", "cost_q95", "common_time_ms", "common_cost", "time_ratio", "cost_ratio", "cpu_ms"}) {
      EXPECT_EQ(row.at(figure).is_null(), !shown) << figure << " of " << row.at("method");
    }
  }
  const Json& column = figures.statistics.at("columns").at(0);
  for (const char* figure : {"cochran_q", "cochran_p", "informative", "reference", "friedman_p"}) {
    EXPECT_EQ(column.at(figure).is_null(), !some) << figure;
  }
  const bool said = figures.texts.front().find("All methods solved the same ones.") != std::string::npos;
  EXPECT_EQ(said, some) << figures.texts.front();
  for (const char* profile : {"effort", "cost"}) {
    EXPECT_EQ(figures.column.at("profiles").at(profile).is_null(), !some) << profile;
  }
  for (const char* curves : {"efforts", "costs"}) {
    for (std::size_t method = 0; method < 4; ++method) {
      EXPECT_EQ(figures.column.at(curves).at(method).is_null(), !some || method == 3) << curves;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(CompleteProblems, UnfinishedFigures, testing::Values(0, 1, 2));

// A row without solved problems does not remove the ratios of other rows, although no problem is solved by all rows.
TEST(PairedRatios, DoNotDependOnARowWithoutSolutions) {
  TestExperiment experiment;
  experiment.methods = {{"A"}, {"B"}, {"bad"}};
  for (int problem = 0; problem < 4; ++problem) {
    experiment.results.push_back({.method = 0, .problem = problem, .cost = 100, .wall_us = 2000});
  }
  for (int problem = 0; problem < 4; ++problem) {
    const bool solved = problem < 2;
    experiment.results.push_back(
        {.method = 1, .problem = problem, .verdict = solved ? "success" : "com", .cost = 150, .wall_us = 8000});
  }
  for (int problem = 0; problem < 4; ++problem) {
    experiment.results.push_back({.method = 2, .problem = problem, .verdict = "com"});
  }
  const StatisticsTable table = FiguresOf(experiment).table;
  EXPECT_EQ(table.columns.at(kColumn).common, 0);
  EXPECT_EQ(table.columns.at(kColumn).reference, "A");
  const auto cell = [&](std::size_t row) { return table.rows.at(row).cells.at(kColumn); };
  EXPECT_EQ(cell(0).paired, 4);
  EXPECT_DOUBLE_EQ(cell(0).time_ratio.value(), 1.0);
  EXPECT_EQ(cell(1).paired, 2);
  EXPECT_NEAR(cell(1).time_ratio.value(), 4.0, 1e-12);
  EXPECT_NEAR(cell(1).cost_ratio.value(), 1.5, 1e-12);
  EXPECT_EQ(cell(2).paired, 0);
  EXPECT_FALSE(cell(2).time_ratio || cell(2).cost_ratio);
}

}  // namespace
}  // namespace legopt::client
