// Guarantees of every Store for reused results: only results of identical jobs are found, and the job that reuses one
// keeps all of it, even if the solved job changes.

#include <functional>

#include "db/audit.h"
#include "db/read_only_database.h"
#include "tests/db/store_conformance.h"

namespace legopt::db {
namespace {

// Returns a search for problem 0, good start, of SampleExperiment(2, 5, 3).
ResultSearch SampleSearch() {
  ResultSearch search;
  search.experiment_id = 2;
  search.dataset_hash = HashOf('d');
  search.method_hash = HashOf('a');
  search.task = Task::kPosture;
  search.initialization = Initialization::kGood;
  search.seed = 1;
  search.wall_limit_us = 60'000'000;
  search.memory_limit_bytes = 1 << 30;
  search.build_id = "0123456789ab";
  search.problems = {{0, 0}};
  return search;
}

std::vector<StoreOp> Solved(std::int64_t job_id, const ResultRecord& result, std::int64_t worker_id = 1) {
  return {LeaseJob{job_id, 1, 700 + job_id, worker_id, 10}, AcceptResult{job_id, 1, result, "", "", 20}};
}

class Takeover : public StoreConformance {
 protected:
  std::int64_t Found(const ResultSearch& search) { return store().FindKnownResults(search).at(0).job_id; }
};

TEST_P(Takeover, AResultIsFoundByAllThatDecidesIt) {
  Prepare();
  EXPECT_EQ(Found(SampleSearch()), 0) << "nothing is solved yet";
  ResultRecord result = SampleResult();
  result.peak_memory_bytes = 1000;
  Apply(Solved(1, result));
  Reopen();
  const auto known = store().FindKnownResults(SampleSearch()).at(0);
  EXPECT_EQ(known.job_id, 1);
  EXPECT_EQ(known.wall_us, result.wall_us);
  EXPECT_TRUE(known.solved);
  const std::vector<std::function<void(ResultSearch&)>> others = {
      [](ResultSearch& s) { s.dataset_hash = HashOf('e'); },
      [](ResultSearch& s) { s.method_hash = HashOf('b'); },
      [](ResultSearch& s) { s.task = Task::kMotion; },
      [](ResultSearch& s) { s.initialization = Initialization::kInCollision; },
      [](ResultSearch& s) { s.seed = 2; },
      [](ResultSearch& s) { s.effort_limit = 1000; },
      [&](ResultSearch& s) { s.wall_limit_us = result.wall_us - 1; },
      [](ResultSearch& s) { s.memory_limit_bytes = 999; },
      [](ResultSearch& s) { s.build_id = "another"; },
      [](ResultSearch& s) { s.experiment_id = 1; },
      [](ResultSearch& s) {
        s.problems = {{1, 0}};
      },
      [](ResultSearch& s) {
        s.problems = {{0, 1}};
      },
  };
  for (std::size_t i = 0; i < others.size(); ++i) {
    ResultSearch search = SampleSearch();
    others[i](search);
    EXPECT_EQ(Found(search), 0) << "change " << i;
  }
  ResultSearch any = SampleSearch();
  any.build_id.reset();
  EXPECT_EQ(Found(any), 1);
}

TEST_P(Takeover, EachProblemOfASearchIsAnswered) {
  Prepare();
  Apply(Solved(2, SampleResult()));
  ResultSearch search = SampleSearch();
  search.problems = {{0, 0}, {1, 0}, {7, 0}};
  const auto known = store().FindKnownResults(search);
  ASSERT_EQ(known.size(), 3U);
  EXPECT_EQ(known[0].job_id, 0);
  EXPECT_EQ(known[1].job_id, 2);
  EXPECT_EQ(known[2].job_id, 0);
}

TEST_P(Takeover, LimitsOfEffortAreEqual) {
  NewExperiment limited = SampleExperiment(1, 1, 1);
  for (CellRecord& cell : limited.cells) cell.effort_limit = 500;
  Apply({CreateExperiment{limited}, PutWorker{SampleWorker(1)}});
  Apply(Solved(1, SampleResult()));
  ResultSearch search = SampleSearch();
  EXPECT_EQ(Found(search), 0) << "without a limit";
  search.effort_limit = 500;
  EXPECT_EQ(Found(search), 1);
}

TEST_P(Takeover, WhatTheClockEndedAndUnknownBuildsAreNotFound) {
  Prepare();
  ResultRecord stopped = SampleResult();
  stopped.solver_status = SolveStatus::kTimeLimit;
  Apply(Solved(1, stopped));
  WorkerRecord nameless = SampleWorker(2);
  nameless.build_id.clear();
  Apply({PutWorker{nameless}});
  Apply(Solved(2, SampleResult(), 2));
  ResultSearch search = SampleSearch();
  search.build_id.reset();
  EXPECT_EQ(Found(search), 0);
  search.problems = {{1, 0}};
  EXPECT_EQ(Found(search), 0);
}

TEST_P(Takeover, ATakenResultIsTheJobsOwn) {
  Prepare();
  Apply(Solved(1, SampleResult()));
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}, CreateExperiment{SampleExperiment(3, 9, 5)}});
  Apply({ReuseResult{5, 1, 805, 30}, ReuseResult{9, 5, 809, 31}});
  Reopen();
  for (const std::int64_t job : {5, 9}) {
    const auto attempt = store().FindAttempt(job, 1);
    ASSERT_TRUE(attempt);
    EXPECT_EQ(attempt->outcome, AttemptOutcome::kFinished);
    EXPECT_EQ(attempt->worker_id, 1) << "who solved it";
    EXPECT_EQ(attempt->job_state, JobState::kDone);
  }
  const OpenState state = store().LoadOpenState();
  EXPECT_EQ(state.experiments.at(0).taken_over, 0);
  EXPECT_EQ(state.experiments.at(1).taken_over, 1);
  EXPECT_EQ(state.experiments.at(1).solved, 1);
  EXPECT_EQ(state.open.at(1).jobs.at(0).state, JobState::kDone);
  EXPECT_EQ(state.open.at(1).jobs.at(0).token, 805);
  ExpectRefused({LeaseJob{5, 2, 900, 1, 40}});
}

TEST_P(Takeover, OnlyAFreshJobTakesAndOnlyWhatIsThere) {
  Prepare();
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}});
  ExpectRefused({ReuseResult{5, 1, 805, 30}});
  Apply(Solved(1, SampleResult()));
  Apply({LeaseJob{5, 1, 71, 1, 25}});
  ExpectRefused({ReuseResult{5, 1, 805, 30}});
  Apply({EndAttempt{5, 1, AttemptOutcome::kReturned, JobState::kQueued, 0, "", "", 26}});
  ExpectRefused({ReuseResult{5, 1, 805, 30}});
  ExpectRefused({ReuseResult{6, 99, 806, 30}});
  ExpectRefused({ReuseResult{99, 1, 807, 30}});
  // All or nothing.
  ExpectRefused({ReuseResult{6, 1, 808, 30}, ReuseResult{6, 1, 809, 30}});
  EXPECT_FALSE(store().FindAttempt(6, 1));
  Apply({ReuseResult{6, 1, 808, 30}});
  EXPECT_EQ(store().FindAttempt(6, 1)->outcome, AttemptOutcome::kFinished);
}

TEST_P(Takeover, TheSourceMayGo) {
  Prepare();
  Apply(Solved(1, SampleResult()));
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}, ReuseResult{5, 1, 805, 30}, CancelExperiment{1, 31},
         DeleteExperiment{1}});
  Reopen();
  const OpenState state = store().LoadOpenState();
  ASSERT_EQ(state.experiments.size(), 1U);
  EXPECT_EQ(state.experiments[0].taken_over, 1);
  EXPECT_EQ(state.experiments[0].solved, 1);
  // A reused result can be reused again.
  ResultSearch search = SampleSearch();
  search.experiment_id = 3;
  EXPECT_EQ(Found(search), 5);
}

INSTANTIATE_TEST_SUITE_P(Stores, Takeover, testing::Values(StoreKind::kSqlite, StoreKind::kMemory),
                         [](const auto& kind) { return kind.param == StoreKind::kSqlite ? "Sqlite" : "Memory"; });

// Rows are equal except for identifiers, and name the worker that solved the job.
TEST(TakeoverRows, AreThoseOfTheSolvedJob) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  const auto store = OpenSqliteStore(path);
  ResultRecord result = SampleResult(321);
  result.waypoints = {1, 2, 3, 4, 5, 6};
  result.trace = {9, 8, 7};
  result.verdict_detail = "all is well";
  std::vector<StoreOp> ops = {CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}};
  for (const StoreOp& op : Solved(1, result)) ops.push_back(op);
  ops.insert(ops.end(), {CreateExperiment{SampleExperiment(2, 5, 3)}, CreateExperiment{SampleExperiment(3, 9, 5)},
                         ReuseResult{5, 1, 805, 30}, ReuseResult{9, 5, 809, 31}});
  store->Apply(ops);
  ReadOnlyDatabase database(path);
  std::string same;
  for (const std::string& column : database.Query("SELECT * FROM results").columns) {
    if (column != "job_id" && column != "cell_id" && column != "received_at_us")
      same += (same.empty() ? "" : ", ") + column;
  }
  EXPECT_EQ(database.Query("SELECT DISTINCT " + same + " FROM results").rows.size(), 1U);
  EXPECT_EQ(database.Query("SELECT DISTINCT waypoint, x FROM waypoints").rows.size(), 2U);
  EXPECT_EQ(database.Query("SELECT job_id, taken_from FROM jobs WHERE taken_from IS NOT NULL").rows,
            (std::vector<std::vector<Value>>{{std::int64_t{5}, std::int64_t{1}}, {std::int64_t{9}, std::int64_t{1}}}));
  EXPECT_EQ(database.Query("SELECT experiment_id, taken_over, done FROM experiment_list").rows,
            (std::vector<std::vector<Value>>{{std::int64_t{1}, std::int64_t{0}, std::int64_t{1}},
                                             {std::int64_t{2}, std::int64_t{1}, std::int64_t{1}},
                                             {std::int64_t{3}, std::int64_t{1}, std::int64_t{1}}}));
  EXPECT_EQ(database.Query("SELECT DISTINCT build_id, results FROM result_origins").rows.size(), 1U);
  for (const AuditDiagnostic& defect : Audit(path)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
}

// With thousands of jobs, each search uses an index and scans no table.
TEST(TakeoverRows, AreFoundByIndexes) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  { OpenSqliteStore(path); }
  ReadOnlyDatabase database(path);
  const auto plan = database.Query(
      "EXPLAIN QUERY PLAN SELECT job_id FROM reusable_results WHERE experiment_id = 1 AND method_hash = 'a' AND task = "
      "'posture' AND initialization = 'good' AND effort_limit IS NULL AND problem_id = 1 AND repetition = 0 ORDER BY "
      "job_id LIMIT 1");
  for (const auto& row : plan.rows) {
    const std::string& step = std::get<std::string>(row.at(3));
    EXPECT_EQ(step.find("SCAN"), std::string::npos) << step;
  }
}

}  // namespace
}  // namespace legopt::db
