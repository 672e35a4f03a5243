// Opening, refusing and upgrading database files.

#include "db/sqlite_store.h"

#include <gtest/gtest.h>

#include <fstream>

#include "db/audit.h"
#include "db/connection.h"
#include "db/migrations.h"
#include "db/read_only_database.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

class SqliteStoreFile : public testing::Test {
 protected:
  void ExpectRefused(const std::filesystem::path& path, StoreErrorCode code) {
    try {
      OpenSqliteStore(path);
      ADD_FAILURE() << "opened " << path;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), code) << error.what();
      EXPECT_NE(std::string(error.what()).find(path.filename().string()), std::string::npos) << error.what();
    }
  }

  std::int64_t QueryInt(const std::string& sql) {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    return connection.QueryInt(sql);
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
};

TEST_F(SqliteStoreFile, NewFileIsMarkedAndDurable) {
  OpenSqliteStore(path_);
  EXPECT_EQ(QueryInt("PRAGMA application_id"), kApplicationId);
  EXPECT_EQ(QueryInt("PRAGMA user_version"), SchemaVersion());
  Connection connection(path_, Connection::Mode::kReadWriteCreate);
  EXPECT_EQ(connection.QueryText("PRAGMA journal_mode"), "wal");
}

// Damage is detected before new results are written, even if the database was closed cleanly.
TEST_F(SqliteStoreFile, ADamagedPageIsNoticedBeforeAnythingIsWritten) {
  OpenSqliteStore(path_)->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1, 500)}});
  const auto size = std::filesystem::file_size(path_);
  constexpr std::uintmax_t kPage = 4096;
  const std::uintmax_t jobs_page =
      static_cast<std::uintmax_t>(QueryInt("SELECT rootpage FROM sqlite_schema WHERE name = 'jobs'"));
  ASSERT_LE(jobs_page * kPage, size);
  {
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(static_cast<std::streamoff>((jobs_page - 1) * kPage));
    file << std::string(kPage, '\0');
  }
  std::ifstream before_file(path_, std::ios::binary);
  const std::string before(std::istreambuf_iterator<char>(before_file), {});
  ExpectRefused(path_, StoreErrorCode::kCorrupt);
  std::ifstream after_file(path_, std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(after_file), {}), before);
}

TEST_F(SqliteStoreFile, ABrokenReferenceBetweenExperimentsMethodsAndProblemsIsRefused) {
  OpenSqliteStore(path_)->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}});
  const auto sound = folder_ / "sound.sqlite";
  std::filesystem::copy_file(path_, sound);
  const std::pair<const char*, const char*> breaks[] = {{"DELETE FROM methods", "table cells, row 1, into methods"},
                                                        {"UPDATE cells SET experiment_id = 99", "into experiments"},
                                                        {"DELETE FROM datasets", "into datasets"}};
  for (const auto& [sql, words] : breaks) {
    std::filesystem::copy_file(sound, path_, std::filesystem::copy_options::overwrite_existing);
    {
      Connection connection(path_, Connection::Mode::kReadWriteCreate);
      connection.Execute("PRAGMA foreign_keys = OFF");
      connection.Execute(sql);
    }
    try {
      OpenSqliteStore(path_);
      ADD_FAILURE() << "opened after " << sql;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << error.what();
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("legopt service restore"), std::string::npos) << error.what();
    }
  }
}

TEST_F(SqliteStoreFile, ADatasetIsStoredOnceAndGoesWithItsLastExperiment) {
  const auto store = OpenSqliteStore(path_);
  const NewExperiment experiment = SampleExperiment(1, 1, 1);
  const StoreDataset dataset{experiment.dataset.hash, std::string("\0archive", 8)};
  store->Apply(std::vector<StoreOp>{CreateExperiment{experiment}, dataset, StoreDataset{HashOf('0'), "unknown"}});
  store->Apply(std::vector<StoreOp>{StoreDataset{dataset.hash, "another"}});
  EXPECT_EQ(QueryInt("SELECT count(*) FROM dataset_archives"), 1);
  EXPECT_EQ(QueryInt("SELECT archive = x'0061726368697665' FROM dataset_archives"), 1);
  store->Apply(std::vector<StoreOp>{CancelExperiment{1, 2}, DeleteExperiment{1}});
  EXPECT_EQ(QueryInt("SELECT count(*) FROM dataset_archives"), 0);
}

TEST_F(SqliteStoreFile, PathMayHoldAnyCharacter) {
  const auto odd = folder_ / "a b?c#d%41é.sqlite";
  OpenSqliteStore(odd);
  EXPECT_TRUE(std::filesystem::exists(odd));
}

TEST_F(SqliteStoreFile, SecondServerIsRefused) {
  const auto first = OpenSqliteStore(path_);
  ExpectRefused(path_, StoreErrorCode::kLocked);
}

TEST_F(SqliteStoreFile, LockEndsWithItsHolderAndLeavesNothing) {
  OpenSqliteStore(path_);
  EXPECT_FALSE(std::filesystem::exists(path_.string() + ".lock"));
  OpenSqliteStore(path_);
}

TEST_F(SqliteStoreFile, LockFileOfADeadServerIsNoObstacle) {
  std::ofstream(path_.string() + ".lock") << "process 1 on nowhere\n";
  OpenSqliteStore(path_);
}

TEST_F(SqliteStoreFile, MissingFolderIsUnwritable) {
  ExpectRefused(folder_ / "no" / "results.sqlite", StoreErrorCode::kUnwritable);
}

TEST_F(SqliteStoreFile, FolderIsUnwritable) {
  std::filesystem::create_directory(folder_ / "folder");
  ExpectRefused(folder_ / "folder", StoreErrorCode::kUnwritable);
}

TEST_F(SqliteStoreFile, ForeignFileIsRefusedAndUntouched) {
  const std::string text(5000, 'x');
  std::ofstream(path_) << text;
  ExpectRefused(path_, StoreErrorCode::kNotLegopt);
  std::ifstream file(path_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), text);
}

TEST_F(SqliteStoreFile, ForeignDatabaseIsRefusedAndUntouched) {
  {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    connection.Execute("CREATE TABLE theirs (x)");
  }
  ExpectRefused(path_, StoreErrorCode::kNotLegopt);
  EXPECT_EQ(QueryInt("SELECT count(*) FROM sqlite_schema"), 1);
  Connection connection(path_, Connection::Mode::kReadWriteCreate);
  EXPECT_EQ(connection.QueryText("PRAGMA journal_mode"), "delete");
}

TEST_F(SqliteStoreFile, NewerSchemaIsRefusedAndUntouched) {
  OpenSqliteStore(path_);
  const int newer = SchemaVersion() + 1;
  {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA user_version = " + std::to_string(newer));
  }
  ExpectRefused(path_, StoreErrorCode::kNewerSchema);
  EXPECT_EQ(QueryInt("PRAGMA user_version"), newer);
}

TEST_F(SqliteStoreFile, JointNamesAreKeptFromWhoeverTellsThemFirst) {
  const auto store = OpenSqliteStore(path_);
  const auto names = [this] {
    return ReadOnlyDatabase(path_).Query("SELECT joint_names FROM datasets").rows.at(0).at(0);
  };
  const auto submit = [&](std::int64_t id, std::vector<std::string> joints) {
    NewExperiment e = SampleExperiment(id, 4 * id, 2 * id);
    e.dataset.joint_names = std::move(joints);
    store->Apply(std::vector<StoreOp>{CreateExperiment{e}});
  };
  submit(1, {});
  EXPECT_EQ(names(), Value(std::monostate{}));
  submit(2, {"hip \"x\"", "knee"});
  EXPECT_EQ(names(), Value(std::string(R"(["hip \"x\"","knee"])")));
  submit(3, {"another"});
  submit(4, {});
  EXPECT_EQ(names(), Value(std::string(R"(["hip \"x\"","knee"])")));
}

// A result stopped by the wall-time limit on a busy machine: result and solution are kept but not counted.
TEST_F(SqliteStoreFile, ARetriedResultIsKeptWithItsSolution) {
  const auto store = OpenSqliteStore(path_);
  ResultRecord result = SampleResult(321);
  result.solver_status = SolveStatus::kTimeLimit;
  result.waypoints = {1, 2, 3, 4, 5, 6};
  store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)},
                                    LeaseJob{1, 1, 71, 1, 1}, AcceptResult{1, 1, result, "", "", 2},
                                    RetryExperiment{1, true, 99}});
  ReadOnlyDatabase database(path_);
  const auto rows = [&](const char* sql) { return database.Query(sql).rows; };
  using Row = std::vector<Value>;
  EXPECT_EQ(rows("SELECT outcome, reason LIKE '%time limit%', received_at_us, solver_status, verdict_strict, cost, "
                 "waypoint_size, hex(x) FROM stale_results"),
            (std::vector<Row>{{std::string("finished"), std::int64_t{1}, std::int64_t{99}, std::string("time_limit"),
                               std::string("success"), 321.0, std::int64_t{3},
                               std::string("000000000000F03F00000000000000400000000000000840"
                                           "000000000000104000000000000014400000000000001840")}}));
  EXPECT_TRUE(rows("SELECT 1 FROM waypoints UNION ALL SELECT 1 FROM results").empty());
  EXPECT_EQ(rows("SELECT sum(solved) FROM benchmark_cells"), (std::vector<Row>{{std::int64_t{0}}}));
}

TEST_F(SqliteStoreFile, NothingOfADeletedExperimentIsLeft) {
  const auto store = OpenSqliteStore(path_);
  store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)},
                                    LeaseJob{1, 1, 71, 1, 1}, AcceptResult{1, 1, SampleResult(), "", "", 2},
                                    LeaseJob{2, 1, 72, 1, 1},
                                    EndAttempt{2, 1, AttemptOutcome::kExpired, JobState::kQueued, 0, "", "", 2},
                                    RecordStaleResult{2, 1, AttemptOutcome::kFinished, "late", SampleResult(), "", 3},
                                    RecordEvent{"job_dead", 4, 1, 2, 1, ""}, TagExperiment{1, "paper", true},
                                    CancelExperiment{1, 5}, DeleteExperiment{1}});
  ReadOnlyDatabase database(path_);
  for (const char* table : {"experiments", "experiment_tags", "cells", "jobs", "attempts", "results", "waypoints",
                            "stale_results", "events"}) {
    EXPECT_TRUE(database.Query("SELECT 1 FROM " + std::string(table)).rows.empty()) << table;
  }
  EXPECT_EQ(database.Query("SELECT kind, largest FROM deleted_ids ORDER BY kind").rows,
            (std::vector<std::vector<Value>>{{std::string("cell"), std::int64_t{2}},
                                             {std::string("experiment"), std::int64_t{1}},
                                             {std::string("job"), std::int64_t{4}}}));
  for (const AuditDiagnostic& defect : Audit(path_)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
}

// A retried job passes the audit, also after further leases were released.
TEST_F(SqliteStoreFile, RetriedJobsAreSound) {
  const auto store = OpenSqliteStore(path_);
  ResultRecord stopped = SampleResult();
  stopped.solver_status = SolveStatus::kTimeLimit;
  store->Apply(std::vector<StoreOp>{
      CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}, LeaseJob{1, 1, 71, 1, 1},
      EndAttempt{1, 1, AttemptOutcome::kReturned, JobState::kQueued, 0, "", "", 2}, LeaseJob{1, 2, 72, 1, 1},
      EndAttempt{1, 2, AttemptOutcome::kCrashed, JobState::kDead, 11, "", "", 2}, LeaseJob{2, 1, 73, 1, 1},
      AcceptResult{2, 1, stopped, "", "", 2}, RetryExperiment{1, true, 3}, LeaseJob{1, 3, 74, 1, 4},
      EndAttempt{1, 3, AttemptOutcome::kReturned, JobState::kQueued, 0, "", "", 5}});
  for (const AuditDiagnostic& defect : Audit(path_)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
}

TEST_F(SqliteStoreFile, WaypointsAreLittleEndianDoubles) {
  {
    const auto store = OpenSqliteStore(path_);
    ResultRecord result = SampleResult();
    result.waypoints = {1.0, 2.0, 3.0, -0.5, 0.25, 1e300};
    store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)},
                                      LeaseJob{1, 1, 71, 1, 1}, AcceptResult{1, 1, result, "", "", 2}});
  }
  Connection connection(path_, Connection::Mode::kReadWriteCreate);
  EXPECT_EQ(connection.QueryText("SELECT group_concat(waypoint || ':' || hex(x)) FROM waypoints"),
            "0:000000000000F03F00000000000000400000000000000840,1:000000000000E0BF000000000000D03F9C7500883CE4377E");
}

}  // namespace
}  // namespace legopt::db
