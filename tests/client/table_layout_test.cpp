// Policy: the two layouts of tables for terminals. No line is wider than requested, no number and no row is lost or
// broken, rows of one name are distinguished, and without a limit nothing changes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>

#include "client/report/benchmark_table.h"
#include "client/report/interpolation_table.h"

namespace legopt::client {
namespace {

using testing::Each;
using testing::HasSubstr;
using testing::Le;
using testing::Not;

BenchmarkCell CellOf(std::int64_t n, std::int64_t solved, double cost, double time_s) {
  BenchmarkCell cell;
  cell.n = cell.finished = cell.problems = n;
  cell.solved = solved;
  if (solved > 0) cell.cost = cost;
  if (solved > 0) cell.time_s = time_s;
  return cell;
}

BenchmarkRow RowOf(const std::string& method, std::int64_t starts, std::int64_t sample,
                   const std::array<BenchmarkCell, 4>& cells) {
  BenchmarkRow row;
  row.method = method;
  row.multi_starts = starts;
  row.sample_size = sample;
  for (std::size_t i = 0; i < cells.size(); ++i) row.cells[kPaperColumns[i]] = cells[i];
  return row;
}

// Returns a table of both tasks with both initial guesses.
BenchmarkTable WideTable() {
  BenchmarkTable table;
  table.experiment_id = 1;
  table.experiment = "quick";
  table.dataset = "garage-easier";
  table.rule = Rule::kLiteral;
  table.columns.assign(kPaperColumns.begin(), kPaperColumns.end());
  table.rows = {RowOf("SQP", 0, 100,
                      {CellOf(50, 49, 350, 1.85e-3), CellOf(50, 49, 352, 2.29e-3), CellOf(4, 4, 0.09, 3.19e-3),
                       CellOf(4, 4, 0.09, 4.63e-3)}),
                RowOf("SQP", 10, 100,
                      {CellOf(50, 50, 663, 3.9e-3), CellOf(50, 50, 779, 4.68e-3), CellOf(4, 4, 0.09, 3.21e-3),
                       CellOf(4, 4, 0.09, 4.24e-3)}),
                RowOf("LegOpt-best", 0, 100,
                      {CellOf(50, 50, 612, 1.75e-3), CellOf(50, 50, 520, 1.1e-3), CellOf(4, 4, 0.08, 2.1e-3),
                       CellOf(4, 0, 0, 0)})};
  return table;
}

std::string Render(const BenchmarkTable& table, std::size_t width, bool color = false) {
  return RenderBenchmarkTable(table, TableFormat::kText, {kMilliseconds, {width, color}});
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<std::size_t> WidthsOf(const std::string& text) {
  std::vector<std::size_t> widths;
  for (const auto& line : LinesOf(text)) widths.push_back(DisplayWidth(line));
  return widths;
}

TEST(TableLayout, GoldenAt180) {
  EXPECT_EQ(Render(WideTable(), 180),
            R"(Experiment 1 'quick', dataset garage-easier, literal rule, 324/324 jobs finished

                                       | Posture generation, good init | Posture generation, init in collision | Motion generation, good init | Motion generation, init in collision
Method       Multi-starts  Sample size |   Success    Cost   Time (ms) |      Success      Cost      Time (ms) |   Success   Cost   Time (ms) |     Success      Cost      Time (ms)
---------------------------------------+-------------------------------+---------------------------------------+------------------------------+-------------------------------------
SQP                     0          100 |     49/50     350        1.85 |        49/50       352           2.29 |       4/4   0.09        3.19 |         4/4      0.09           4.63
SQP                    10          100 |     50/50     663        3.90 |        50/50       779           4.68 |       4/4   0.09        3.21 |         4/4      0.09           4.24
LegOpt-best             0          100 |     50/50     612        1.75 |        50/50       520           1.10 |       4/4   0.08        2.10 |         0/4         -              -

Costs and times are averaged over successfully solved problems, per waypoint.
)");
}

TEST(TableLayout, StackedIfItDoesNotFit) {
  BenchmarkTable table = WideTable();
  table.rows.erase(table.rows.begin() + 1);
  table.columns = {kPaperColumns[0], kPaperColumns[3]};
  EXPECT_EQ(Render(table, 70), R"(Experiment 1 'quick', dataset garage-easier, literal rule, 216/216
jobs finished

Method        SQP
Multi-starts  0
Sample size   100
Posture generation, good init
  Success     49/50
  Cost        350
  Time (ms)   1.85
Motion generation, init in collision
  Success     4/4
  Cost        0.09
  Time (ms)   4.63

Method        LegOpt-best
Multi-starts  0
Sample size   100
Posture generation, good init
  Success     50/50
  Cost        612
  Time (ms)   1.75
Motion generation, init in collision
  Success     0/4
  Cost        -
  Time (ms)   -

Costs and times are averaged over successfully solved problems, per
waypoint.
)");
}

TEST(TableLayout, WithoutALimitItIsTheWidestOne) {
  EXPECT_EQ(Render(WideTable(), 0), Render(WideTable(), 180));
  EXPECT_EQ(Render(WideTable(), 0), RenderBenchmarkTable(WideTable(), TableFormat::kText));
}

TEST(TableLayout, ColourChangesNoWidth) {
  for (const std::size_t width : {0U, 120U, 80U, 60U}) {
    std::string colored = Render(WideTable(), width, true);
    EXPECT_THAT(colored, HasSubstr("\033[1m"));
    for (const char* escape : {"\033[0m", "\033[1m", "\033[2m", "\033[31m"}) {
      for (std::size_t at; (at = colored.find(escape)) != std::string::npos;)
        colored.erase(at, std::string(escape).size());
    }
    EXPECT_EQ(colored, Render(WideTable(), width));
  }
}

TEST(TableLayout, BestIsAmongTheRowsThatSolveMost) {
  const std::string text = Render(WideTable(), 0, true);
  EXPECT_THAT(text, HasSubstr("\033[1m50/50\033[0m"));
  EXPECT_THAT(text, HasSubstr("\033[1m612\033[0m"));       // best of the rows with 50/50
  EXPECT_THAT(text, Not(HasSubstr("\033[1m350\033[0m")));  // cheaper, but over 49 problems
  EXPECT_THAT(text, Not(HasSubstr("\033[1m0/4\033[0m")));
}

TEST(TableLayout, BrokenJobsAreSeenInEveryLayout) {
  BenchmarkTable table = WideTable();
  BenchmarkCell& cell = table.rows[0].cells[kPaperColumns[0]];
  cell.dead = 1;
  cell.failed = 2;
  cell.cancelled = 3;
  cell.finished = 40;
  for (const std::size_t width : {0U, 240U, 80U, 30U}) {
    std::string text;
    std::istringstream words(Render(table, width));
    for (std::string word; words >> word;) text += word + " ";
    for (const char* part : {"49/50 (1 dead,", "2 failed,", "3 cancelled,", "10 left)"}) {
      EXPECT_THAT(text, HasSubstr(part)) << width;
    }
  }
  EXPECT_THAT(Render(table, 0, true), HasSubstr("\033[31m49/50 (1 dead, 2 failed, 3 cancelled, 10 left)\033[0m"));
}

TEST(TableLayout, RowsOfOneNameAreToldApart) {
  BenchmarkTable table = WideTable();
  table.rows[2] = table.rows[1];
  table.rows[2].sample_size = 80;
  table.rows.push_back(table.rows[1]);
  table.rows.back().collision = SceneRepresentation::kSurface;
  for (const std::size_t width : {0U, 200U}) {
    const std::string text = Render(table, width);
    std::set<std::string> names;
    for (const auto& line : LinesOf(text)) {
      if (line.rfind("SQP", 0) == 0) names.insert(line.substr(0, line.find('|')));
    }
    EXPECT_EQ(names.size(), 4U) << text;
  }
  EXPECT_THAT(Render(table, 40), HasSubstr("Sample size   80"));
  EXPECT_THAT(Render(table, 40), HasSubstr("surface"));
}

// Random tables with long names: at every width all numbers are present and unbroken.
class RandomTables : public testing::Test {
 protected:
  BenchmarkTable Make() {
    BenchmarkTable table = WideTable();
    table.experiment = Name(60);
    table.dataset = Name(60);
    table.columns.clear();
    for (const auto& column : kPaperColumns) {
      if (random_() % 3 > 0) table.columns.push_back(column);
    }
    table.rows.resize(1 + random_() % 4);
    for (auto& row : table.rows) {
      row = RowOf(Name(200), Draw(1000), Draw(100) + 1, {Cell(), Cell(), Cell(), Cell()});
      if (random_() % 2 == 0) row.collision = SceneRepresentation::kSurface;
      if (random_() % 4 == 0) row.paper = row.cells;
      if (random_() % 4 == 0 && !table.columns.empty()) row.cells.erase(table.columns.front());
    }
    return table;
  }

  static std::vector<std::string> NumbersOf(const BenchmarkTable& table) {
    std::vector<std::string> numbers;
    for (const auto& row : table.rows) {
      numbers.push_back(std::to_string(row.multi_starts));
      numbers.push_back(std::to_string(row.sample_size));
      for (const auto& column : table.columns) {
        const auto found = row.cells.find(column);
        if (found == row.cells.end()) continue;
        const BenchmarkCell& cell = found->second;
        numbers.push_back(std::to_string(cell.solved) + "/" + std::to_string(cell.n));
        numbers.push_back(FormatCost(cell.cost));
        numbers.push_back(FormatTime(cell.time_s, kMilliseconds));
        if (cell.dead > 0) numbers.push_back(std::to_string(cell.dead));
      }
    }
    return numbers;
  }

 private:
  std::int64_t Draw(std::uint32_t below) { return static_cast<std::int64_t>(random_() % below); }

  std::string Name(std::size_t longest) {
    const std::string letters = "abcdefghijklmnop  -_%,";
    std::string name = "m";
    for (std::size_t i = random_() % longest; i > 0; --i) name += letters[random_() % letters.size()];
    return name;
  }

  BenchmarkCell Cell() {
    const std::int64_t n = 1 + Draw(3000);
    const std::int64_t solved = random_() % 4 == 0 ? 0 : Draw(static_cast<std::uint32_t>(n)) + 1;
    const double scale = std::pow(10.0, static_cast<double>(random_() % 9) - 5.0);
    BenchmarkCell cell = CellOf(n, solved, 3.21 * scale * 1e3, 1.234 * scale);
    cell.dead = random_() % 3 == 0 ? Draw(5) : 0;
    cell.finished -= random_() % 3 == 0 ? Draw(static_cast<std::uint32_t>(n)) : 0;
    return cell;
  }

  std::mt19937 random_{11};
};

TEST_F(RandomTables, FitAndLoseNothing) {
  for (int trial = 0; trial < 60; ++trial) {
    const BenchmarkTable table = Make();
    const auto numbers = NumbersOf(table);
    for (std::size_t width = kSmallestWidth; width <= 200; width += 1 + width / 8) {
      const std::string text = Render(table, width);
      ASSERT_THAT(WidthsOf(text), Each(Le(width))) << text;
      std::set<std::string> words;
      std::istringstream stream(text);
      for (std::string word; stream >> word;) {
        words.insert(word);
        // The number without the punctuation of a sentence.
        words.insert(word.substr(word.find_first_not_of('('), word.find_last_not_of(",)d") + 1));
      }
      for (const auto& number : numbers) ASSERT_TRUE(words.count(number) == 1) << number << "\n" << width << text;
    }
  }
}

InterpolationTable ExampleInterpolation() {
  InterpolationTable table;
  table.experiment = "e";
  table.rows = {
      {"SQP", 0, 100, SceneRepresentation::kSolid, {{Initialization::kGood, {5, 4, 4, 3, 0.975, 0.0123, 0.0}}}},
      {"SQP", 0, 100, SceneRepresentation::kSurface, {{Initialization::kGood, {5, 5, 5, 5, 1.0, 0.0004, 0.0002}}}}};
  return table;
}

TEST(InterpolationLayout, Golden) {
  EXPECT_EQ(RenderInterpolationTable(ExampleInterpolation(), TableFormat::kText),
            R"(Interpolation of the motions of experiment 0 'e', solid rule

                                             |         Motion generation, good init
Method  Multi-starts  Sample size  Collision | Free  Share (percent)  Scene (mm)  Self (mm)
---------------------------------------------+---------------------------------------------
SQP                0          100      solid |  3/4             97.5        12.3        0.0
SQP                0          100    surface |  5/5            100.0         0.4        0.2

Ten configurations between consecutive waypoints of each solved motion, by the exact meshes: motions free of penetration above 1 mm, mean share of such transitions, largest depths. No part of the verdict.
)");
}

TEST(InterpolationLayout, FitsToo) {
  const InterpolationTable table = ExampleInterpolation();
  EXPECT_EQ(RenderInterpolationTable(table, TableFormat::kText, {.layout = {240, false}}),
            RenderInterpolationTable(table, TableFormat::kText));
  for (const std::size_t width : {30U, 60U, 80U, 100U}) {
    const std::string text = RenderInterpolationTable(table, TableFormat::kText, {.layout = {width, false}});
    EXPECT_THAT(WidthsOf(text), Each(Le(width))) << text;
    for (const char* part : {"3/4", "97.5", "12.3", "100.0", "0.4", "surface"}) EXPECT_THAT(text, HasSubstr(part));
  }
}

}  // namespace
}  // namespace legopt::client
