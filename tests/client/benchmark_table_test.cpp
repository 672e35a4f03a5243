// Policy: the table has the paper's layout, n in every cell and a dash where nothing was solved; all five formats say
// the same.
#include "client/benchmark_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "client/interpolation_table.h"
#include "client/paper_table.h"
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
    EXPECT_THAT((std::vector<std::string>(lines[l].begin(), lines[l].begin() + 3)),
                ElementsAre("table_1", "garage & co", "literal"));
    std::vector<std::string> row(lines[l].begin() + 3, lines[l].begin() + 6);
    for (std::size_t i = 6; i < lines[l].size(); i += 5) {
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
  cells.columns = {"method_id", "method",   "multi_starts", "sample_size", "collision", "task",      "initialization",
                   "n",         "finished", "solved",       "cost",        "time_s",    "experiment"};
  cells.rows = {{9, "I-SQP", 10, 80, "solid", "motion", "good", 5, 5, 5, 0.13, 0.001, "e"},
                {9, "I-SQP", 10, 80, "solid", "posture", "in_collision", 5, 5, 0, nullptr, nullptr, "e"},
                {2, "SQP", 0, 100, "surface", "posture", "in_collision", 5, 4, 3, 400.0, 0.002, "e"}};
  const BenchmarkTable table = BuildBenchmarkTable(cells, 1, "strict");
  EXPECT_THAT(table.columns, ElementsAre(kPostureHard, kMotionGood));
  ASSERT_EQ(table.rows.size(), 2U);
  EXPECT_EQ(table.rows[0].method, "I-SQP");  // the order of the rows, not of the ids
  EXPECT_EQ(table.rows[0].cells.at(kPostureHard), (BenchmarkCell{5, 5, 0, std::nullopt, std::nullopt}));
  EXPECT_EQ(table.rows[1].cells.at(kPostureHard), (BenchmarkCell{5, 4, 3, 400.0, 0.002}));
  EXPECT_EQ(table.num_jobs(), 15);
  EXPECT_EQ(table.num_finished(), 14);
}

TEST(BenchmarkTable, CollisionIsAColumnWhereItDiffers) {
  BenchmarkTable table = Example();
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kText), Not(HasSubstr("Collision")));
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kCsv), Not(HasSubstr("collision,")));
  table.rows[1].collision = "surface";
  const auto text = ParseTextTable(RenderBenchmarkTable(table, TableFormat::kText));
  EXPECT_EQ(text.rows[0][3], "solid");
  EXPECT_EQ(text.rows[1][3], "surface");
  EXPECT_EQ(ParseMarkdownTable(RenderBenchmarkTable(table, TableFormat::kMarkdown)).rows, text.rows);
  const std::string latex = RenderBenchmarkTable(table, TableFormat::kLatex);
  EXPECT_EQ(ParseLatexTable(latex).rows, text.rows);
  EXPECT_THAT(latex, HasSubstr("\\cmidrule(lr){5-7}"));
  EXPECT_EQ(ParseCsv(RenderBenchmarkTable(table, TableFormat::kCsv))[2][6], "surface");
  EXPECT_EQ(nlohmann::json::parse(RenderBenchmarkTable(table, TableFormat::kJson)).at("rows")[1].at("collision"),
            "surface");
}

class PaperTable : public testing::Test {
 protected:
  void SetUp() override {
    const auto paper = ReadPaperTable(std::filesystem::path(LEGOPT_SOURCE_DIR) / "data" / "paper-table1.csv");
    ASSERT_EQ(paper.size(), 16U);
    table_.rows[1].method = "i-sqp";
    AddPaperFigures(paper, &table_);
  }
  BenchmarkTable table_ = Example();
};

TEST_F(PaperTable, MatchesByNameStartsAndSampleSize) {
  EXPECT_EQ(table_.rows[0].paper.at(kPostureGood), (BenchmarkCell{50, 50, 49, 427.0, 1.32}));
  EXPECT_EQ(table_.rows[1].paper.at(kMotionGood), (BenchmarkCell{50, 50, 42, 0.13, 0.53}));
  BenchmarkTable other = Example();
  AddPaperFigures({table_.rows[0]}, &other);
  EXPECT_TRUE(other.rows[1].paper.empty());
}

TEST_F(PaperTable, StandsBesideOursInAllFormats) {
  const auto text = ParseTextTable(RenderBenchmarkTable(table_, TableFormat::kText));
  ASSERT_EQ(text.rows.size(), 4U);
  EXPECT_THAT(text.rows[3], ElementsAre("", "paper", "10", "80", "50/50", "461", "1000", "50/50", "468", "1340",
                                        "42/50", "0.13", "530"));
  EXPECT_EQ(ParseMarkdownTable(RenderBenchmarkTable(table_, TableFormat::kMarkdown)).rows[3][3], "50/50");
  EXPECT_EQ(ParseLatexTable(RenderBenchmarkTable(table_, TableFormat::kLatex)).rows[3][4], "461");
  EXPECT_THAT(RenderBenchmarkTable(table_, TableFormat::kText), HasSubstr("Humanoids 2017"));
  const auto csv = ParseCsv(RenderBenchmarkTable(table_, TableFormat::kCsv));
  const auto column = std::find(csv[0].begin(), csv[0].end(), "paper_motion_good_solved") - csv[0].begin();
  EXPECT_EQ(csv.at(2).at(static_cast<std::size_t>(column)), "42");
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table_, TableFormat::kJson));
  EXPECT_EQ(json.at("rows")[1].at("paper").at("motion").at("good").at("solved"), 42);
}

TEST_F(PaperTable, WhereNothingWasSolvedItHasADash) {
  BenchmarkTable table = Example();
  table.rows[1].method = "SQP";
  AddPaperFigures(ReadPaperTable(std::filesystem::path(LEGOPT_SOURCE_DIR) / "data" / "paper-table1.csv"), &table);
  EXPECT_EQ(table.rows[1].paper.at(kMotionGood), (BenchmarkCell{50, 50, 0, std::nullopt, std::nullopt}));
}

TEST(InterpolationTable, AllFormatsHaveTheSameCells) {
  Listing cells;
  cells.columns = {"method_id",           "method",      "multi_starts", "sample_size", "collision", "experiment",
                   "initialization",      "n",           "solved",       "scored",      "free",      "free_share",
                   "environment_depth_m", "self_depth_m"};
  cells.rows = {{3, "SQP", 0, 100, "solid", "e", "good", 5, 4, 4, 3, 0.975, 0.0123, 0.0},
                {3, "SQP", 0, 100, "solid", "e", "in_collision", 5, 0, 0, 0, nullptr, nullptr, nullptr},
                {4, "SQP", 0, 100, "surface", "e", "good", 5, 5, 5, 5, 1.0, 0.0004, 0.0002}};
  const InterpolationTable table = BuildInterpolationTable(cells, 2, "literal");
  const std::string text = RenderInterpolationTable(table, TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("experiment 2 'e'"));
  const auto rows = ParseTextTable(text).rows;
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_THAT(rows[0], ElementsAre("SQP", "0", "100", "solid", "3/4", "97.5", "12.3", "0.0", "-", "-", "-", "-"));
  EXPECT_THAT(rows[1], ElementsAre("SQP", "0", "100", "surface", "5/5", "100.0", "0.4", "0.2", "-", "-", "-", "-"));
  EXPECT_EQ(ParseMarkdownTable(RenderInterpolationTable(table, TableFormat::kMarkdown)).rows, rows);
  EXPECT_EQ(ParseLatexTable(RenderInterpolationTable(table, TableFormat::kLatex)).rows, rows);
  const auto csv = ParseCsv(RenderInterpolationTable(table, TableFormat::kCsv));
  EXPECT_THAT(csv[1], ElementsAre("SQP", "0", "100", "solid", "good", "5", "4", "4", "3", "0.975", "0.0123", "0.0"));
  const auto json = nlohmann::json::parse(RenderInterpolationTable(table, TableFormat::kJson));
  EXPECT_EQ(json.at("cells")[2].at("free"), 5);
  EXPECT_TRUE(json.at("cells")[1].at("free_share").is_null());
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
