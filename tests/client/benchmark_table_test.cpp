// Policy: the table has the paper's layout, with n in every cell and a dash where nothing was solved. All five formats
// contain the same values.
#include "client/report/benchmark_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "client/client_error.h"
#include "client/report/interpolation_table.h"
#include "client/report/reading.h"
#include "example_table.h"
#include "table_parsers.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

// Returns a cell as text, as the text table shows the values in CSV or JSON.
std::vector<std::string> Shown(const BenchmarkCell& cell, const TimeUnit& unit) {
  return {ShownValue(ShownSuccess(cell).value), FormatCost(cell.cost), FormatTime(cell.time_s, unit)};
}

std::vector<std::vector<std::string>> FromCsv(const std::string& text, const BenchmarkTable& table,
                                              const TimeUnit& unit) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& line : CsvRows(text)) {
    EXPECT_EQ(line.at("experiment_id"), "3");
    EXPECT_EQ(line.at("experiment"), "table_1");
    EXPECT_EQ(line.at("dataset"), "garage & co");
    EXPECT_EQ(line.at("rule"), "literal");
    std::vector<std::string> row = {line.at("method"), line.at("multi_starts"), line.at("sample_size")};
    for (const auto& column : table.columns) {
      const auto field = [&](const char* figure) { return line.at(ColumnName(column) + "_" + figure); };
      const auto number = [&](const char* figure) {
        return field(figure).empty() ? std::optional<double>() : std::optional(std::stod(field(figure)));
      };
      if (field("n").empty()) {
        row.insert(row.end(), 3, "-");
        continue;
      }
      const auto shown = Shown({std::stoll(field("n")), std::stoll(field("finished")), std::stoll(field("solved")),
                                number("cost"), number("time_s")},
                               unit);
      row.insert(row.end(), shown.begin(), shown.end());
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<std::vector<std::string>> CellsOfJson(const std::string& text, const BenchmarkTable& table,
                                                  const TimeUnit& unit) {
  const auto json = nlohmann::json::parse(text);
  std::vector<std::vector<std::string>> rows;
  for (const auto& line : json.at("rows")) {
    std::vector<std::string> row = {line.at("method").get<std::string>(), line.at("multi_starts").dump(),
                                    line.at("sample_size").dump()};
    for (const auto& column : table.columns) {
      const std::string task(ToString(column.task)), initialization(ToString(column.initialization));
      if (!line.contains(task) || !line.at(task).contains(initialization)) {
        row.insert(row.end(), 3, "-");
        continue;
      }
      const auto& cell = line.at(task).at(initialization);
      const auto number = [&cell](const char* key) {
        return cell.at(key).is_null() ? std::optional<double>() : std::optional(cell.at(key).get<double>());
      };
      const auto shown = Shown({cell.at("n").get<std::int64_t>(), cell.at("finished").get<std::int64_t>(),
                                cell.at("solved").get<std::int64_t>(), number("cost"), number("time_s")},
                               unit);
      row.insert(row.end(), shown.begin(), shown.end());
    }
    rows.push_back(row);
  }
  return rows;
}

TEST(BenchmarkTable, AllFormatsAreEqualInContent) {
  const BenchmarkTable table = ExampleTable();
  const auto text = ParseTextTable(RenderBenchmarkTable(table, TableFormat::kText));
  const TimeUnit unit = kMilliseconds;
  EXPECT_EQ(text.time_unit, "ms");
  ASSERT_EQ(text.rows.size(), 2U);
  EXPECT_THAT(text.rows[0], ElementsAre("SQP", "0", "100", "34/35", "396", "1.46", "29/35 (5 left)", "402", "12.4",
                                        "12/35", "0.13", "2.30"));
  EXPECT_THAT(text.rows[1],
              ElementsAre("I-SQP|80%_a&b", "10", "80", "0/35", "-", "-", "- (35 left)", "-", "-", "-", "-", "-"));
  const auto markdown = ParseMarkdownTable(RenderBenchmarkTable(table, TableFormat::kMarkdown));
  EXPECT_EQ(markdown.rows, text.rows);
  EXPECT_EQ(markdown.time_unit, text.time_unit);
  const auto latex = ParseLatexTable(RenderBenchmarkTable(table, TableFormat::kLatex));
  EXPECT_EQ(latex.rows, text.rows);
  EXPECT_EQ(latex.time_unit, text.time_unit);
  EXPECT_EQ(FromCsv(RenderBenchmarkTable(table, TableFormat::kCsv), table, unit), text.rows);
  EXPECT_EQ(CellsOfJson(RenderBenchmarkTable(table, TableFormat::kJson), table, unit), text.rows);
}

TEST(BenchmarkTable, CaptionTellsExperimentRuleAndProgress) {
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    const std::string text = RenderBenchmarkTable(ExampleTable(), format);
    EXPECT_THAT(text, HasSubstr("Experiment 3"));
    EXPECT_THAT(text, HasSubstr("literal rule"));
    EXPECT_THAT(text, HasSubstr("135/175 jobs finished"));
    EXPECT_THAT(text, HasSubstr("averaged over successfully solved problems"));
  }
}

// Counts by a weaker rule are always accompanied by those of the other rule.
TEST(BenchmarkTable, CountsByTheOtherRuleAreShownBelow) {
  BenchmarkTable table = ExampleTable();
  table.other_rule = Rule::kSolid;
  table.rows[0].cells[kPostureGood].solved_by_other_rule = 6;
  table.rows[1].cells[kPostureGood].solved_by_other_rule = 0;
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown}) {
    EXPECT_THAT(RenderBenchmarkTable(table, format),
                HasSubstr("Solved by the solid rule: SQP 6/35, 0/35, 0/35; I-SQP"));
  }
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kLatex), HasSubstr("Solved by the solid rule: SQP 6/35"));
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson));
  EXPECT_EQ(json.at("other_rule").at("rule"), "solid");
  EXPECT_EQ(json.at("other_rule").at("solved")[0].at("posture_good"), 6);
  EXPECT_THAT(RenderBenchmarkTable(ExampleTable(), TableFormat::kText), testing::Not(HasSubstr("Solved by the")));
}

TEST(BenchmarkTable, GroupsAreNamedInThePapersWords) {
  const std::string text = RenderBenchmarkTable(ExampleTable(), TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("Posture generation, good init"));
  EXPECT_THAT(text, HasSubstr("Posture generation, init in collision"));
  EXPECT_THAT(text, HasSubstr("Motion generation, good init"));
  EXPECT_THAT(text, Not(HasSubstr("Motion generation, init in collision")));
}

TEST(BenchmarkTable, TextColumnsLineUp) {
  const std::string text = RenderBenchmarkTable(ExampleTable(), TableFormat::kText);
  std::vector<std::size_t> bars;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find(" | ") == std::string::npos) continue;
    // Position of the last bar: no cell contains one except the method's name, which is in the first column.
    bars.push_back(line.rfind(" | "));
  }
  ASSERT_EQ(bars.size(), 4U);  // groups, titles, two rows
  for (const auto bar : bars) EXPECT_EQ(bar, bars.front());
}

TEST(BenchmarkTable, LatexIsBooktabsAndEscaped) {
  const std::string text = RenderBenchmarkTable(ExampleTable(), TableFormat::kLatex);
  for (const char* part :
       {"\\toprule", "\\midrule", "\\bottomrule", "\\cmidrule(lr){4-6}", "table\\_1", "garage \\& co", "80\\%"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(BenchmarkTable, IsBuiltFromTheViewsRows) {
  Listing cells;
  cells.columns = {"method_id",      "method",     "multi_starts", "sample_size", "collision", "task",
                   "initialization", "n",          "finished",     "solved",      "cost",      "time_s",
                   "experiment",     "dead",       "failed",       "cancelled",   "problems",  "repetitions",
                   "clock_stopped",  "taken_over", "inner_starts"};
  cells.rows = {
      {9, "I-SQP", 10, 80, "solid", "motion", "good", 5, 5, 5, 0.13, 0.001, "e", 0, 0, 0, 5, 1, 0, 0, 8},
      {9, "I-SQP", 10, 80, "solid", "posture", "in_collision", 6, 6, 0, nullptr, nullptr, "e", 1, 2, 3, 3, 2, 1, 4, 8},
      {2, "SQP", 0, 100, "surface", "posture", "in_collision", 5, 4, 3, 400.0, 0.002, "e", 0, 0, 0, 5, 1, 0, 0, 0}};
  const BenchmarkTable table = BuildBenchmarkTable(cells, 1, Rule::kStrict);
  EXPECT_THAT(table.columns, ElementsAre(kPostureHard, kMotionGood));
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].method, "I-SQP");  // in the order of the rows, not of the ids
  EXPECT_EQ(table.rows[0].cells.at(kPostureHard),
            (BenchmarkCell{6, 6, 0, std::nullopt, std::nullopt, 1, 2, 3, 3, 2, 1, 4}));
  EXPECT_EQ(table.rows[0].inner_starts, 8);
  EXPECT_EQ(table.rows[1].inner_starts, 0);
  EXPECT_EQ(table.rows[1].cells.at(kPostureHard), (BenchmarkCell{5, 4, 3, 400.0, 0.002, 0, 0, 0, 5, 1}));
  EXPECT_EQ(table.Sum().n, 16);
  EXPECT_EQ(table.Sum().finished, 15);
  EXPECT_EQ(table.Sum().cancelled, 3);
  EXPECT_EQ(table.Sum().taken_over, 4);
}

// Unknown words, which a later release may have stored, are refused.
TEST(BenchmarkTable, UnknownWordsAreRefusedByName) {
  Listing cells;
  cells.columns = {"task"};
  cells.rows = {{"posture"}, {"climb"}};
  EXPECT_EQ(cells.EnumAt<Task>(0, "task"), Task::kPosture);
  try {
    cells.EnumAt<Task>(1, "task");
    FAIL() << "no error";
  } catch (const ClientError& error) {
    EXPECT_EQ(error.code(), ExitCode::kDatabaseUnusable);
    EXPECT_THAT(error.what(), HasSubstr("task 'climb'"));
  }
}

TEST(BenchmarkTable, CollisionIsAColumnWhereItDiffers) {
  BenchmarkTable table = ExampleTable();
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kText), Not(HasSubstr("Collision")));
  table.rows[1].collision = SceneRepresentation::kSurface;
  const auto text = ParseTextTable(RenderBenchmarkTable(table, TableFormat::kText));
  EXPECT_EQ(text.rows[0][3], "solid");
  EXPECT_EQ(text.rows[1][3], "surface");
  EXPECT_EQ(ParseMarkdownTable(RenderBenchmarkTable(table, TableFormat::kMarkdown)).rows, text.rows);
  const std::string latex = RenderBenchmarkTable(table, TableFormat::kLatex);
  EXPECT_EQ(ParseLatexTable(latex).rows, text.rows);
  EXPECT_THAT(latex, HasSubstr("\\cmidrule(lr){5-7}"));
  EXPECT_EQ(CsvRows(RenderBenchmarkTable(table, TableFormat::kCsv))[1].at("collision"), "surface");
  EXPECT_EQ(nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson)).at("rows")[1].at("collision"),
            "surface");
}

// Internal restarts of a method are counted in the note, because its number of restarts does not include them.
TEST(BenchmarkTable, InternalRestartsAreCounted) {
  const TemporaryFolder folder;
  const auto file = folder / "test.sqlite";
  TestExperiment experiment;
  experiment.methods = {{"LegOpt-best", 0, "solid", R"({"options":{"rescues":8}})"}, {"SQP", 10}};
  for (const int problem : {0, 1, 2}) {
    experiment.results.push_back({.method = 0, .problem = problem, .starts = problem == 2 ? 6 : 1});
    experiment.results.push_back({.method = 1, .problem = problem, .starts = 9});
  }
  experiment.results.push_back({.method = 0, .initialization = "in_collision", .problem = 0, .starts = 3});
  WriteTestDatabase(file, experiment);
  const auto source = OpenResults({file.string(), {}});
  TableSelection selection;
  selection.filter.initializations = {"in_collision"};
  EXPECT_THAT(RenderBenchmarkTable(ReadBenchmarkTable(*source, selection), TableFormat::kText),
              HasSubstr("the first one of each window: LegOpt-best 2 on average, at most 2. "));
  selection.filter.initializations = {"good"};
  const BenchmarkTable table = ReadBenchmarkTable(*source, selection);
  const std::string text = RenderBenchmarkTable(table, TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("the first one of each window: LegOpt-best 1.7 on average, at most 5. "));
  EXPECT_EQ(ParseTextTable(text).rows[0][1], "0");
  const auto csv = CsvRows(RenderBenchmarkTable(table, TableFormat::kCsv));
  EXPECT_EQ(csv[0].at("inner_starts"), "8");
  EXPECT_EQ(csv[1].at("inner_starts"), "0");
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson));
  EXPECT_EQ(json.at("rows")[0].at("inner_starts"), 8);
  EXPECT_EQ(json.at("rows")[0].at("further_starts").at("largest"), 5);
  EXPECT_TRUE(json.at("rows")[1].at("further_starts").is_null());
}

TEST(BenchmarkTable, CsvHasTheSameColumnsForEveryExperiment) {
  BenchmarkTable other = ExampleTable();
  other.columns = {kMotionGood};
  other.rows[1].collision = SceneRepresentation::kSurface;
  const auto titles = ParseCsv(RenderBenchmarkTable(ExampleTable(), TableFormat::kCsv))[0];
  EXPECT_EQ(ParseCsv(RenderBenchmarkTable(other, TableFormat::kCsv))[0], titles);
  EXPECT_EQ(ParseCsv(RenderBenchmarkTable(BenchmarkTable(), TableFormat::kCsv))[0], titles);
  EXPECT_EQ(titles.size(), 9U + 4 * 12 + 1);
  const auto row = CsvRows(RenderBenchmarkTable(ExampleTable(), TableFormat::kCsv))[1];
  EXPECT_EQ(row.at("collision"), "solid");
  EXPECT_EQ(row.at("motion_in_collision_n"), "");
}

// Returns a table with one dead job after two attempts, one job that could not run, two cancelled ones and one
// pending.
BenchmarkTable Broken() {
  BenchmarkTable table = ExampleTable();
  table.columns = {kPostureGood};
  table.rows.resize(1);
  table.rows[0].cells = {{kPostureGood, {9, 8, 4, 396.0, 0.001, 1, 1, 2, 3, 3}}};
  return table;
}

TEST(BenchmarkTable, JobsWithoutResultsAreVisible) {
  const std::string text = RenderBenchmarkTable(Broken(), TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("8/9 jobs finished, of these 1 dead, 1 failed, 2 cancelled"));
  EXPECT_THAT(text, HasSubstr("4/9 (1 dead, 1 failed, 2 cancelled, 1 left)"));
  const auto row = CsvRows(RenderBenchmarkTable(Broken(), TableFormat::kCsv)).at(0);
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(Broken(), TableFormat::kJson));
  const std::map<std::string, int> expected = {{"n", 9},      {"finished", 8},  {"solved", 4},   {"dead", 1},
                                               {"failed", 1}, {"cancelled", 2}, {"problems", 3}, {"repetitions", 3}};
  for (const auto& [figure, value] : expected) {
    EXPECT_EQ(row.at("posture_good_" + figure), std::to_string(value)) << figure;
    EXPECT_EQ(json.at("rows")[0].at("posture").at("good").at(figure), value) << figure;
  }
  EXPECT_EQ(json.at("dead"), 1);
  EXPECT_EQ(json.at("failed"), 1);
  EXPECT_EQ(json.at("cancelled"), 2);
}

// Runs stopped by the wall-time limit say nothing about the method: every format shows their number and a remedy.
TEST(BenchmarkTable, RunsStoppedByTheTimeLimitAreListedBelow) {
  BenchmarkTable table = Broken();
  table.rows[0].cells[kPostureGood].clock_stopped = 2;
  for (const TableFormat format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    EXPECT_THAT(RenderBenchmarkTable(table, format), HasSubstr("\nThe clock ended 2 jobs (the wall-time limit"));
    EXPECT_THAT(RenderBenchmarkTable(table, format), HasSubstr("legopt retry 3 "));
    EXPECT_THAT(RenderBenchmarkTable(Broken(), format), Not(HasSubstr("clock")));
  }
  EXPECT_EQ(CsvRows(RenderBenchmarkTable(table, TableFormat::kCsv)).at(0).at("posture_good_clock_stopped"), "2");
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson));
  EXPECT_EQ(json.at("clock_stopped"), 2);
  EXPECT_EQ(json.at("rows")[0].at("posture").at("good").at("clock_stopped"), 2);
  InterpolationTable between;
  between.experiment_id = 3;
  InterpolationCell cell;
  cell.n = 5;
  cell.clock_stopped = 1;
  between.rows = {{"SQP", 0, 100, SceneRepresentation::kSolid, {{Initialization::kGood, cell}}}};
  EXPECT_THAT(RenderInterpolationTable(between, TableFormat::kText),
              HasSubstr("\nThe clock ended 1 job (the wall-time limit"));
  EXPECT_THAT(RenderInterpolationTable(between, TableFormat::kCsv), HasSubstr("clock_stopped"));
}

TEST(BenchmarkTable, WhatWasTakenOverIsTold) {
  BenchmarkTable table = ExampleTable();
  table.rows[0].cells[kPostureGood].taken_over = 2;
  table.rows[1].cells[kPostureGood].taken_over = 1;
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    EXPECT_THAT(RenderBenchmarkTable(table, format), HasSubstr("3 results were reused from other experiments."));
    EXPECT_THAT(RenderBenchmarkTable(ExampleTable(), format), Not(HasSubstr("reused")));
  }
  EXPECT_EQ(CsvRows(RenderBenchmarkTable(table, TableFormat::kCsv)).at(0).at("posture_good_taken_over"), "2");
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson));
  EXPECT_EQ(json.at("taken_over"), 3);
  EXPECT_EQ(json.at("rows")[0].at("posture").at("good").at("taken_over"), 2);
  InterpolationTable between;
  between.taken_over = 1;
  EXPECT_THAT(RenderInterpolationTable(between, TableFormat::kText), HasSubstr("1 result was reused"));
}

TEST(BenchmarkTable, RepetitionsAreNotProblems) {
  EXPECT_THAT(RenderBenchmarkTable(Broken(), TableFormat::kText), HasSubstr("; 3 problems x 3 repetitions\n"));
  EXPECT_THAT(RenderBenchmarkTable(ExampleTable(), TableFormat::kText), Not(HasSubstr("repetition")));
  BenchmarkTable table = Broken();
  table.columns.push_back(kMotionGood);
  table.rows[0].cells[kMotionGood] = {3, 3, 3, 0.1, 0.001, 0, 0, 0, 1, 3};
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kText),
              HasSubstr("; posture 3 problems x 3 repetitions, motion 1 problem x 3 repetitions\n"));
}

TEST(BenchmarkTable, RowsThatWouldReadTheSameGetTheirMethodsId) {
  Listing cells;
  cells.columns = {"method_id",      "method",     "multi_starts", "sample_size", "collision", "task",
                   "initialization", "n",          "finished",     "solved",      "cost",      "time_s",
                   "experiment",     "dead",       "failed",       "cancelled",   "problems",  "repetitions",
                   "clock_stopped",  "taken_over", "inner_starts"};
  for (const int id : {4, 7}) {
    cells.rows.push_back(
        {id, "SQP", 0, 100, "solid", "posture", "good", 5, 5, 5, 400.0, 0.001, "e", 0, 0, 0, 5, 1, 0, 0, 0});
  }
  cells.rows.push_back(
      {9, "SQP", 10, 100, "solid", "posture", "good", 5, 5, 5, 400.0, 0.001, "e", 0, 0, 0, 5, 1, 0, 0, 0});
  const BenchmarkTable table = BuildBenchmarkTable(cells, 1, Rule::kLiteral);
  EXPECT_EQ(table.rows[0].method, "SQP (method 4)");
  EXPECT_EQ(table.rows[1].method, "SQP (method 7)");
  EXPECT_EQ(table.rows[2].method, "SQP");
}

TEST(BenchmarkTable, WithoutRowsItIsStillATable) {
  BenchmarkTable table;
  table.rule = Rule::kLiteral;
  for (const auto format :
       {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex, TableFormat::kCsv, TableFormat::kJson}) {
    EXPECT_FALSE(RenderBenchmarkTable(table, format).empty());
  }
}

TEST(FormatCost, FollowsThePaper) {
  EXPECT_EQ(FormatCost(std::nullopt), "-");
  EXPECT_EQ(FormatCost(396.5001), "397");
  EXPECT_EQ(FormatCost(1.0), "1");
  EXPECT_EQ(FormatCost(0.134), "0.13");
  EXPECT_EQ(FormatCost(0.0), "0.00");
  EXPECT_EQ(FormatCost(0.0012), "1.2e-03");  // 0.00 is shown only for zero
}

TEST(FormatTime, ShowsThreeSignificantDigits) {
  const TimeUnit ms{"ms", 1e-3};
  EXPECT_EQ(FormatTime(std::nullopt, ms), "-");
  EXPECT_EQ(FormatTime(0.00145678, ms), "1.46");
  EXPECT_EQ(FormatTime(0.009996, ms), "10.0");
  EXPECT_EQ(FormatTime(0.0145678, ms), "14.6");
  EXPECT_EQ(FormatTime(0.09996, ms), "100");
  EXPECT_EQ(FormatTime(0.145678, ms), "146");
  EXPECT_EQ(FormatTime(0.000912345, ms), "0.912");
  EXPECT_EQ(FormatTime(0.0009, ms), "0.900");
  EXPECT_EQ(FormatTime(0.0009996, ms), "1.00");
  EXPECT_EQ(FormatTime(0.00002, ms), "0.0200");
  EXPECT_EQ(FormatTime(0.000000002, ms), "2.00e-06");
  EXPECT_EQ(FormatTime(0.0, ms), "0.00");
  EXPECT_EQ(FormatTime(1.45678, ms), "1457");
}

TEST(TimeUnit, DoesNotDependOnTheData) {
  for (const double time_s : {4.0, 0.0013, 0.00002}) {
    BenchmarkTable table = ExampleTable();
    for (auto& row : table.rows) {
      for (auto& [column, cell] : row.cells) cell.time_s = time_s;
    }
    EXPECT_EQ(ParseTextTable(RenderBenchmarkTable(table, TableFormat::kText)).time_unit, "ms");
  }
  BenchmarkTable unsolved = ExampleTable();
  for (auto& row : unsolved.rows) {
    for (auto& [column, cell] : row.cells) cell.solved = 0, cell.cost = cell.time_s = std::nullopt;
  }
  EXPECT_EQ(ParseTextTable(RenderBenchmarkTable(unsolved, TableFormat::kText)).time_unit, "ms");
}

TEST(TimeUnit, IsTheOneAskedFor) {
  for (const TimeUnit& unit : {kSeconds, kMilliseconds, kMicroseconds}) {
    const TableStyle style{unit, {}};
    EXPECT_EQ(ParseTextTable(RenderBenchmarkTable(ExampleTable(), TableFormat::kText, style)).time_unit, unit.name);
  }
  const TableStyle micro{kMicroseconds, {}};
  EXPECT_EQ(ParseTextTable(RenderBenchmarkTable(ExampleTable(), TableFormat::kText, micro)).rows[0][5], "1457");
  EXPECT_THAT(RenderBenchmarkTable(ExampleTable(), TableFormat::kLatex, micro), HasSubstr("Time ($\\mu$s)"));
}

}  // namespace
}  // namespace legopt::client
