// The paper's figures beside ours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "client/report/benchmark_table.h"
#include "example_table.h"
#include "table_parsers.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class PaperTable : public testing::Test {
 protected:
  void SetUp() override {
    const auto paper = ReadPaperTable(std::filesystem::path(SourceFolder()) / "data" / "paper-table1.csv");
    ASSERT_EQ(paper.size(), 16U);
    table_.rows[1].method = "i-sqp";
    AddPaperFigures(paper, &table_);
  }
  BenchmarkTable table_ = ExampleTable();
};

TEST_F(PaperTable, MatchesByNameStartsAndSampleSize) {
  EXPECT_EQ(table_.rows[0].paper.at(kPostureGood), (BenchmarkCell{50, 50, 49, 427.0, 1.32}));
  EXPECT_EQ(table_.rows[1].paper.at(kMotionGood), (BenchmarkCell{50, 50, 42, 0.13, 0.53}));
  BenchmarkTable other = ExampleTable();
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
  const auto csv = CsvRows(RenderBenchmarkTable(table_, TableFormat::kCsv));
  EXPECT_EQ(csv.at(1).at("paper_motion_good_solved"), "42");
  const auto json = nlohmann::json::parse(RenderBenchmarkTable(table_, TableFormat::kJson));
  EXPECT_EQ(json.at("rows")[1].at("paper").at("motion").at("good").at("solved"), 42);
}

TEST_F(PaperTable, ItsOwnUnitIsTheSecond) {
  const TableStyle seconds{kSeconds, {}};
  const auto text = ParseTextTable(RenderBenchmarkTable(table_, TableFormat::kText, seconds));
  EXPECT_EQ(text.time_unit, "s");
  EXPECT_THAT(text.rows[3], ElementsAre("", "paper", "10", "80", "50/50", "461", "1.00", "50/50", "468", "1.34",
                                        "42/50", "0.13", "0.530"));
}

TEST_F(PaperTable, SaysWhenItHasNoneOfTheRows) {
  BenchmarkTable table = ExampleTable();
  table.rows.resize(1);
  table.rows[0].method = "ours";
  AddPaperFigures(ReadPaperTable(std::filesystem::path(SourceFolder()) / "data" / "paper-table1.csv"), &table);
  EXPECT_THAT(RenderBenchmarkTable(table, TableFormat::kText), HasSubstr("Table I has none of these rows"));
}

TEST_F(PaperTable, WhereNothingWasSolvedItHasADash) {
  BenchmarkTable table = ExampleTable();
  table.rows[1].method = "SQP";
  AddPaperFigures(ReadPaperTable(std::filesystem::path(SourceFolder()) / "data" / "paper-table1.csv"), &table);
  EXPECT_EQ(table.rows[1].paper.at(kMotionGood), (BenchmarkCell{50, 50, 0, std::nullopt, std::nullopt}));
}

}  // namespace
}  // namespace legopt::client
