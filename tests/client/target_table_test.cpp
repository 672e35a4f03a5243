// Policy: a target is relative to the best cost that any shown row reached, also from another initialization. A run
// that does not solve its problem reaches no target, and its effort counts. Missing runs do not count. Efforts are
// never mixed: work if it was counted for every run of a column, else CPU time.
#include "client/compare/target_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace legopt::client {
namespace {

using statistics::RunOutcome;
using testing::HasSubstr;

const BenchmarkColumn kGood = {Task::kPosture, Initialization::kGood};
const BenchmarkColumn kInCollision = {Task::kPosture, Initialization::kInCollision};

Solve SolveOf(int problem, RunOutcome end, double cost, double work_ms) {
  Solve solve;
  solve.problem = problem;
  solve.end = end;
  solve.cost = cost;
  solve.work_ms = work_ms;
  solve.time_ms = 100.0;
  solve.reported = end != RunOutcome::kMissing;
  return solve;
}

SolveCell CellOf(std::int64_t method, const BenchmarkColumn& column, const std::vector<Solve>& solves) {
  SolveCell cell;
  cell.cell_id = method * 10 + (column == kGood ? 0 : 1);
  cell.method.method_id = method;
  cell.method.name = method == 1 ? "A" : "B";
  cell.column = column;
  cell.num_jobs = static_cast<std::int64_t>(solves.size());
  cell.limit_ms = 1000.0;
  cell.solves = solves;
  return cell;
}

// A solves both problems, the second at twice B's cost from starts in collision; B fails the first.
SolvedExperiment Pool() {
  SolvedExperiment experiment;
  experiment.info.name = "pool";
  const auto solved = RunOutcome::kSolved, failed = RunOutcome::kFailed;
  experiment.cells = {CellOf(1, kGood, {SolveOf(0, solved, 10.0, 1.0), SolveOf(1, solved, 20.0, 3.0)}),
                      CellOf(1, kInCollision, {SolveOf(0, solved, 11.0, 1.0), SolveOf(1, failed, 0.0, 5.0)}),
                      CellOf(2, kGood, {SolveOf(0, failed, 0.0, 8.0), SolveOf(1, solved, 12.0, 2.0)}),
                      CellOf(2, kInCollision, {SolveOf(0, failed, 0.0, 8.0), SolveOf(1, solved, 10.0, 2.0)})};
  return experiment;
}

TEST(TargetTable, TheBestCostIsThatOfAllRowsAndInitializations) {
  const TargetTable table = ComputeTargets(Pool(), Rule::kSolid, {1.0, 1.2, 2.0});
  const TargetCell& a = table.cells.at(0).at(kGood);
  EXPECT_EQ(a.n, 2);
  EXPECT_EQ(a.targets[0].reached, 1.0) << "problem 0 at its best cost";
  EXPECT_EQ(a.targets[1].reached, 1.0);
  EXPECT_EQ(a.targets[2].reached, 2.0) << "problem 1 at twice the cost from the other start";
  EXPECT_DOUBLE_EQ(a.targets[0].ert_ms.value(), 4.0) << "the effort of both runs for one that reaches";
  EXPECT_DOUBLE_EQ(a.targets[2].ert_ms.value(), 2.0);
  EXPECT_DOUBLE_EQ(a.gap_median, 0.5) << "between 0 and 1";
  const TargetCell& b = table.cells.at(1).at(kGood);
  EXPECT_EQ(b.targets[0].reached, 0.0);
  EXPECT_FALSE(b.targets[0].ert_ms.has_value());
  EXPECT_DOUBLE_EQ(b.targets[1].ert_ms.value(), 10.0) << "the failed run's effort counts";
  EXPECT_TRUE(std::isinf(b.gap_median)) << "between a gap and a failure";
}

TEST(TargetTable, RepetitionsAreAveragedAndMissingOnesDoNotCount) {
  SolvedExperiment experiment = Pool();
  experiment.cells = {CellOf(1, kGood,
                             {SolveOf(0, RunOutcome::kSolved, 10.0, 1.0), SolveOf(0, RunOutcome::kSolved, 30.0, 3.0),
                              SolveOf(0, RunOutcome::kMissing, 0.0, 0.0), SolveOf(1, RunOutcome::kMissing, 0.0, 0.0)})};
  const TargetTable table = ComputeTargets(experiment, Rule::kSolid, {1.5});
  const TargetCell& cell = table.cells.at(0).at(kGood);
  EXPECT_EQ(cell.n, 1);
  EXPECT_EQ(cell.targets[0].reached, 0.5);
  EXPECT_DOUBLE_EQ(cell.targets[0].ert_ms.value(), 4.0);
  EXPECT_DOUBLE_EQ(cell.gap_median, 1.0) << "the mean cost is twice the best";
  EXPECT_TRUE(table.by_work.at(kGood));
}

TEST(TargetTable, WithOneUncountedRunTheColumnUsesTimes) {
  SolvedExperiment experiment = Pool();
  experiment.cells[2].solves[0].work_ms = 0.0;
  const TargetTable table = ComputeTargets(experiment, Rule::kSolid, {2.0});
  EXPECT_FALSE(table.by_work.at(kGood));
  EXPECT_TRUE(table.by_work.at(kInCollision));
  EXPECT_DOUBLE_EQ(table.cells.at(0).at(kGood).targets[0].ert_ms.value(), 100.0);
}

TEST(TargetTable, AllFormatsHaveTheSameRows) {
  const TargetTable table = ComputeTargets(Pool(), Rule::kSolid, {1.2, 2.0});
  const auto rows = nlohmann::json::parse(RenderTargetTable(table, TableFormat::kJson));
  ASSERT_EQ(rows.size(), 4U);
  EXPECT_EQ(rows[0]["method"], "A");
  EXPECT_EQ(rows[0]["reached_1.2"], 1.0);
  EXPECT_EQ(rows[0]["measure"], "work");
  EXPECT_TRUE(rows[1]["gap_median"].is_null());
  const std::string text = RenderTargetTable(table, TableFormat::kText);
  EXPECT_THAT(text, HasSubstr("cost at most 1.2 x best"));
  EXPECT_THAT(text, HasSubstr("effort: work"));
}

}  // namespace
}  // namespace legopt::client
