#include "client/report/interpolation_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "table_parsers.h"

namespace legopt::client {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(InterpolationTable, AllFormatsHaveTheSameCells) {
  Listing cells;
  cells.columns = {"method_id",
                   "method",
                   "multi_starts",
                   "sample_size",
                   "collision",
                   "experiment",
                   "initialization",
                   "n",
                   "solved",
                   "scored",
                   "free",
                   "free_share",
                   "environment_depth_m",
                   "self_depth_m",
                   "clock_stopped",
                   "inner_starts"};
  cells.rows = {{3, "SQP", 0, 100, "solid", "e", "good", 5, 4, 4, 3, 0.975, 0.0123, 0.0, 1, 8},
                {3, "SQP", 0, 100, "solid", "e", "in_collision", 5, 0, 0, 0, nullptr, nullptr, nullptr, 0, 8},
                {4, "SQP", 0, 100, "surface", "e", "good", 5, 5, 5, 5, 1.0, 0.0004, 0.0002, 0, 0}};
  const InterpolationTable table = BuildInterpolationTable(cells, 2, Rule::kLiteral);
  const std::string text = RenderInterpolationTable(table, TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("experiment 2 'e'"));
  const auto rows = ParseTextTable(text).rows;
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_THAT(rows[0], ElementsAre("SQP", "0", "100", "solid", "3/4", "97.5", "12.3", "0.0", "-", "-", "-", "-"));
  EXPECT_THAT(rows[1], ElementsAre("SQP", "0", "100", "surface", "5/5", "100.0", "0.4", "0.2", "-", "-", "-", "-"));
  EXPECT_EQ(ParseMarkdownTable(RenderInterpolationTable(table, TableFormat::kMarkdown)).rows, rows);
  EXPECT_EQ(ParseLatexTable(RenderInterpolationTable(table, TableFormat::kLatex)).rows, rows);
  const auto csv = ParseCsv(RenderInterpolationTable(table, TableFormat::kCsv));
  EXPECT_THAT(csv[1], ElementsAre("2", "e", "", "literal", "SQP", "0", "8", "100", "solid", "good", "5", "4", "4", "3",
                                  "0.975", "0.0123", "0.0", "1"));
  const auto json = nlohmann::json::parse(RenderInterpolationTable(table, TableFormat::kJson));
  EXPECT_EQ(json.at("cells")[2].at("free"), 5);
  EXPECT_TRUE(json.at("cells")[1].at("free_share").is_null());
}

}  // namespace
}  // namespace legopt::client
