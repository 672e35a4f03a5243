// The counts of cells and experiments equal those of the jobs in every state of a job's life.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "db/audit.h"
#include "db/connection.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

class CellStates : public testing::Test {
 protected:
  void Apply(const std::vector<StoreOp>& ops, const char* what) {
    store_->Apply(ops);
    EXPECT_EQ(Counted("FROM jobs JOIN cells USING (cell_id) GROUP BY experiment_id"), Listed()) << what;
    for (const AuditDiagnostic& defect : Audit(path_)) ADD_FAILURE() << what << ": " << defect.rule << defect.detail;
  }
  std::string Read(const std::string& sql) {
    Connection connection(path_, Connection::Mode::kReadOnly);
    return connection.QueryText("SELECT coalesce(group_concat(line, char(10)), '') FROM (" + sql + ")");
  }
  std::string Counted(const std::string& from) {
    std::string sums;
    for (const char* state : {"queued", "leased", "done", "failed", "dead", "cancelled"}) {
      sums += std::string(" || ' ' || count(*) FILTER (WHERE state = '") + state + "')";
    }
    return Read("SELECT experiment_id" + sums + " || ' ' || count(taken_from) AS line " + from);
  }
  std::string Listed() {
    return Read(
        "SELECT experiment_id || ' ' || queued || ' ' || leased || ' ' || done || ' ' || failed || ' ' || dead || ' ' "
        "|| cancelled || ' ' || taken_over AS line FROM experiment_list ORDER BY experiment_id");
  }
  static EndAttempt End(std::int64_t job, int attempt, AttemptOutcome outcome, JobState next) {
    return {job, attempt, outcome, next, 0, "it crashed", "", 20};
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<Store> store_ = OpenSqliteStore(path_);
};

TEST_F(CellStates, CountJobsInEveryState) {
  Apply({CreateExperiment{SampleExperiment(1, 1, 1, 3)}, PutWorker{SampleWorker(1)}}, "submitted");
  Apply({LeaseJob{1, 1, 11, 1, 10}, LeaseJob{2, 1, 12, 1, 10}, LeaseJob{3, 1, 13, 1, 10}}, "leased");
  ResultRecord stopped = SampleResult();
  stopped.solver_status = SolveStatus::kTimeLimit;
  Apply({AcceptResult{1, 1, SampleResult(), "", "", 20}, AcceptResult{2, 1, stopped, "", "", 20},
         End(3, 1, AttemptOutcome::kCrashed, JobState::kDead)},
        "ended");
  Apply({LeaseJob{4, 1, 14, 1, 10}, End(4, 1, AttemptOutcome::kError, JobState::kFailed), LeaseJob{5, 1, 15, 1, 10},
         End(5, 1, AttemptOutcome::kReturned, JobState::kQueued)},
        "failed, returned");
  EXPECT_EQ(Read("SELECT done || ' ' || failed || ' ' || dead || ' ' || finished AS line FROM cell_states"),
            "2 0 1 3\n0 1 0 1");
  Apply({RetryExperiment{1, true, 40}}, "queued again");
  EXPECT_EQ(Read("SELECT done || ' ' || finished AS line FROM cell_states"), "1 1\n0 0");
  Apply({LeaseJob{3, 2, 23, 1, 50}, AcceptResult{3, 2, SampleResult(), "", "", 60}, LeaseJob{6, 1, 16, 1, 50}},
        "the dead job is solved");
  Apply({CancelExperiment{1, 70}}, "cancelled with a running job");
  Apply({CreateExperiment{SampleExperiment(2, 7, 3, 3)}, ReuseResult{7, 1, 31, 80}}, "a result is reused");
  EXPECT_EQ(Read("SELECT done || ' ' || taken_over AS line FROM cell_states WHERE experiment_id = 2"), "1 1\n0 0");
  Apply({DeleteExperiment{1}}, "deleted");
}

// Tables of millions of jobs read only the indexes of few rows.
TEST_F(CellStates, AreReadFromIndexes) {
  Connection connection(path_, Connection::Mode::kReadOnly);
  for (const char* view : {"cell_states", "experiment_list", "benchmark_table"}) {
    Statement plan(connection, std::string("EXPLAIN QUERY PLAN SELECT * FROM ") + view, false);
    while (plan.Step()) {
      const std::string step = plan.column_text(3);
      EXPECT_EQ(step.find("SCAN j"), std::string::npos) << view << ": " << step;
      EXPECT_EQ(step.find("sqlite_autoindex_jobs_1"), std::string::npos) << view << ": " << step;
    }
  }
}

}  // namespace
}  // namespace legopt::db
