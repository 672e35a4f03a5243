// Policy: the table has the paper's layout, n in every cell and a dash where nothing was solved; all five formats say
// the same.
#include "client/benchmark_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "table_parsers.h"

namespace legopt::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

const BenchmarkColumn kPostureGood = {"posture", "good"};
const BenchmarkColumn kPostureHard = {"posture", "in_collision"};
const BenchmarkColumn kMotionGood = {"motion", "good"};

BenchmarkTable Example() {
  BenchmarkTable table;
  table.experiment_id = 3;
  table.experiment = "table_1";
  table.dataset = "garage & co";
  table.rule = "literal";
  table.columns = {kPostureGood, kPostureHard, kMotionGood};
  table.rows = {{"SQP",
                 0,
                 100,
                 {{kPostureGood, {35, 35, 34, 396.4999, 0.0014567}},
                  {kPostureHard, {35, 30, 29, 401.5, 0.01236}},
                  {kMotionGood, {35, 35, 12, 0.134, 0.0023}}}},
                {"I-SQP|80%_a&b",
                 10,
                 80,
                 {{kPostureGood, {35, 35, 0, std::nullopt, std::nullopt}}, {kPostureHard, {35, 0, 0, {}, {}}}}}};
  return table;
}

// The shown cells that a row of CSV or JSON figures amounts to.
std::vector<std::string> Shown(const BenchmarkCell& cell, const TimeUnit& unit) {
  return {FormatSuccess(cell), FormatCost(cell.cost), FormatTime(cell.time_s, unit)};
}

std::vector<std::vector<std::string>> FromCsv(const std::string& text, const TimeUnit& unit) {
  const auto lines = ParseCsv(text);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t l = 1; l < lines.size(); ++l) {
    std::vector<std::string> row(lines[l].begin(), lines[l].begin() + 3);
    for (std::size_t i = 3; i < lines[l].size(); i += 5) {
      const auto number = [](const std::string& field) {
        return field.empty() ? std::optional<double>() : std::optional(std::stod(field));
      };
      if (lines[l][i].empty()) {
        row.insert(row.end(), 3, "-");
        continue;
      }
      const auto shown = Shown({std::stoll(lines[l][i]), std::stoll(lines[l][i + 1]), std::stoll(lines[l][i + 2]),
                                number(lines[l][i + 3]), number(lines[l][i + 4])},
                               unit);
      row.insert(row.end(), shown.begin(), shown.end());
    }
    rows.push_back(row);
  }
  return rows;
}

std::vector<std::vector<std::string>> FromJson(const std::string& text, const BenchmarkTable& table,
                                               const TimeUnit& unit) {
  const auto json = nlohmann::json::parse(text);
  std::vector<std::vector<std::string>> rows;
  for (const auto& line : json.at("rows")) {
    std::vector<std::string> row = {line.at("method").get<std::string>(), line.at("multi_starts").dump(),
                                    line.at("sample_size").dump()};
    for (const auto& [task, initialization] : table.columns) {
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
  const BenchmarkTable table = Example();
  const auto text = ParseTextTable(RenderBenchmarkTable(table, TableFormat::kText));
  const TimeUnit unit = ChooseTimeUnit(table);
  EXPECT_EQ(text.time_unit, "ms");
  EXPECT_EQ(unit.name, "ms");
  ASSERT_EQ(text.rows.size(), 2U);
  EXPECT_THAT(text.rows[0], ElementsAre("SQP", "0", "100", "34/35", "396", "1.46", "29/35 (5 left)", "402", "12.4",
                                        "12/35", "0.13", "2.30"));
  EXPECT_THAT(text.rows[1],
              ElementsAre("I-SQP|80%_a&b", "10", "80", "0/35", "-", "-", "0/35 (35 left)", "-", "-", "-", "-", "-"));
  const auto markdown = ParseMarkdownTable(RenderBenchmarkTable(table, TableFormat::kMarkdown));
  EXPECT_EQ(markdown.rows, text.rows);
  EXPECT_EQ(markdown.time_unit, text.time_unit);
  const auto latex = ParseLatexTable(RenderBenchmarkTable(table, TableFormat::kLatex));
  EXPECT_EQ(latex.rows, text.rows);
  EXPECT_EQ(latex.time_unit, text.time_unit);
  EXPECT_EQ(FromCsv(RenderBenchmarkTable(table, TableFormat::kCsv), unit), text.rows);
  EXPECT_EQ(FromJson(RenderBenchmarkTable(table, TableFormat::kJson), table, unit), text.rows);
}

TEST(BenchmarkTable, CaptionTellsExperimentRuleAndProgress) {
  for (const auto format : {TableFormat::kText, TableFormat::kMarkdown, TableFormat::kLatex}) {
    const std::string text = RenderBenchmarkTable(Example(), format);
    EXPECT_THAT(text, HasSubstr("Experiment 3"));
    EXPECT_THAT(text, HasSubstr("literal rule"));
    EXPECT_THAT(text, HasSubstr("135/175 jobs finished"));
    EXPECT_THAT(text, HasSubstr("averaged over successfully solved problems"));
  }
}

TEST(BenchmarkTable, GroupsAreNamedInThePapersWords) {
  const std::string text = RenderBenchmarkTable(Example(), TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("Posture generation, good init"));
  EXPECT_THAT(text, HasSubstr("Posture generation, init in collision"));
  EXPECT_THAT(text, HasSubstr("Motion generation, good init"));
  EXPECT_THAT(text, Not(HasSubstr("Motion generation, init in collision")));
}

TEST(BenchmarkTable, TextColumnsLineUp) {
  const std::string text = RenderBenchmarkTable(Example(), TableFormat::kText);
  std::vector<std::size_t> bars;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find(" | ") == std::string::npos) continue;
    // The last bar: cells hold none, except the method's name, which stands first.
    bars.push_back(line.rfind(" | "));
  }
  ASSERT_EQ(bars.size(), 4U);  // groups, titles, two rows
  for (const auto bar : bars) EXPECT_EQ(bar, bars.front());
}

TEST(BenchmarkTable, LatexIsBooktabsAndEscaped) {
  const std::string text = RenderBenchmarkTable(Example(), TableFormat::kLatex);
  for (const char* part :
       {"\\toprule", "\\midrule", "\\bottomrule", "\\cmidrule(lr){4-6}", "table\\_1", "garage \\& co", "80\\%"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
}

TEST(BenchmarkTable, IsBuiltFromTheViewsRows) {
  Listing cells;
  cells.columns = {"method_id", "method",   "multi_starts", "sample_size", "task",   "initialization",
                   "n",         "finished", "solved",       "cost",        "time_s", "experiment"};
  cells.rows = {{9, "I-SQP", 10, 80, "motion", "good", 5, 5, 5, 0.13, 0.001, "e"},
                {9, "I-SQP", 10, 80, "posture", "in_collision", 5, 5, 0, nullptr, nullptr, "e"},
                {2, "SQP", 0, 100, "posture", "in_collision", 5, 4, 3, 400.0, 0.002, "e"}};
  const BenchmarkTable table = BuildBenchmarkTable(cells, 1, "strict");
  EXPECT_THAT(table.columns, ElementsAre(kPostureHard, kMotionGood));
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].method, "I-SQP");  // the order of the rows, not of the ids
  EXPECT_EQ(table.rows[0].cells.at(kPostureHard), (BenchmarkCell{5, 5, 0, std::nullopt, std::nullopt}));
  EXPECT_EQ(table.rows[1].cells.at(kPostureHard), (BenchmarkCell{5, 4, 3, 400.0, 0.002}));
  EXPECT_EQ(table.num_jobs(), 15);
  EXPECT_EQ(table.num_finished(), 14);
}

TEST(BenchmarkTable, WithoutRowsItIsStillATable) {
  BenchmarkTable table;
  table.rule = "literal";
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
  EXPECT_EQ(FormatCost(0.0012), "1.2e-03");  // never 0.00 for something that is not zero
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
  EXPECT_EQ(FormatTime(1.45678, ms), "1457");
}

TEST(TimeUnit, FitsTheTypicalTime) {
  const auto unit_for = [](std::vector<double> times) {
    BenchmarkTable table;
    for (const double time : times) table.rows.push_back({"m", 0, 100, {{kPostureGood, {1, 1, 1, 1.0, time}}}});
    return ChooseTimeUnit(table).name;
  };
  EXPECT_EQ(unit_for({1.3, 4.0}), "s");
  EXPECT_EQ(unit_for({0.0013, 0.017}), "ms");
  EXPECT_EQ(unit_for({0.00002}), "us");
  EXPECT_EQ(unit_for({}), "s");
}

}  // namespace
}  // namespace legopt::client
