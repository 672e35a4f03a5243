#include "db/read_only_database.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <thread>

#include "db/backup.h"
#include "db/connection.h"
#include "db/migrations.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

class ReadOnly : public testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenSqliteStore(path_);
    store_->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}});
  }

  void ExpectError(const std::function<void()>& action, StoreErrorCode code) {
    try {
      action();
      ADD_FAILURE() << "no error";
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), code) << error.what();
    }
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::unique_ptr<Store> store_;
};

TEST_F(ReadOnly, SeesTheLastCommitOfALiveServer) {
  ReadOnlyDatabase database(path_);
  EXPECT_EQ(database.Query("SELECT count(*) FROM experiments").rows[0][0], Value(std::int64_t{1}));
  store_->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(2, 5, 3)}});
  EXPECT_EQ(database.Query("SELECT count(*) FROM experiments").rows[0][0], Value(std::int64_t{2}));
}

TEST_F(ReadOnly, EveryTypeAndParameters) {
  ReadOnlyDatabase database(path_);
  const std::vector<Value> parameters{std::int64_t{7}, 0.5, std::string("text"), Blob{std::string("\0\1", 2)},
                                      std::monostate{}};
  const QueryResult result = database.Query("SELECT ?1 AS a, ?2, ?3, ?4, ?5", parameters);
  EXPECT_EQ(result.columns[0], "a");
  ASSERT_EQ(result.rows.size(), 1U);
  EXPECT_EQ(result.rows[0], parameters);
  EXPECT_FALSE(result.truncated);
}

TEST_F(ReadOnly, RowLimitTruncates) {
  ReadOnlyDatabase database(path_);
  const std::string sql = "SELECT job_id FROM jobs";
  EXPECT_EQ(database.Query(sql, 4).rows.size(), 4U);
  EXPECT_FALSE(database.Query(sql, 4).truncated);
  EXPECT_EQ(database.Query(sql, 3).rows.size(), 3U);
  EXPECT_TRUE(database.Query(sql, 3).truncated);
}

TEST_F(ReadOnly, ByteLimitTruncates) {
  ReadOnlyDatabase database(path_);
  QueryLimits limits;
  limits.max_bytes = 1 << 20;
  const auto result = database.Query(
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1000) SELECT zeroblob(100000) FROM n",
      {}, limits);
  EXPECT_TRUE(result.truncated);
  EXPECT_LT(result.rows.size(), 20U);
}

TEST_F(ReadOnly, TimeLimitInterrupts) {
  ReadOnlyDatabase database(path_);
  QueryLimits limits;
  limits.time_limit = std::chrono::milliseconds(20);
  const std::string endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";
  ExpectError([&] { database.Query(endless, {}, limits); }, StoreErrorCode::kInterrupted);
  EXPECT_EQ(database.Query("SELECT 1").rows.size(), 1U);
}

TEST_F(ReadOnly, NothingCanBeChanged) {
  ReadOnlyDatabase database(path_);
  for (const char* sql :
       {"DELETE FROM jobs", "UPDATE jobs SET state = 'done'", "INSERT INTO datasets VALUES (9, 'x', 'y')",
        "CREATE TABLE t (x)", "CREATE TEMP TABLE t (x)", "DROP VIEW failures", "BEGIN", "VACUUM",
        "PRAGMA journal_mode = DELETE", "PRAGMA query_only = 0", "PRAGMA user_version = 9", "ATTACH '/tmp/x' AS x",
        "ANALYZE", "SELECT load_extension('x')"}) {
    ExpectError([&] { database.Query(sql); }, StoreErrorCode::kBadQuery);
  }
}

TEST_F(ReadOnly, OneStatementAtATime) {
  ReadOnlyDatabase database(path_);
  EXPECT_EQ(database.Query("SELECT 1;  -- done").rows.size(), 1U);
  ExpectError([&] { database.Query("SELECT 1; SELECT 2"); }, StoreErrorCode::kBadQuery);
  ExpectError([&] { database.Query("SELECT 1; DELETE FROM jobs"); }, StoreErrorCode::kBadQuery);
  ExpectError([&] { database.Query("  -- nothing"); }, StoreErrorCode::kBadQuery);
  ExpectError([&] { database.Query("SELECT nonsense"); }, StoreErrorCode::kBadQuery);
}

TEST_F(ReadOnly, SchemaCanBeDescribed) {
  ReadOnlyDatabase database(path_);
  EXPECT_GT(database.Query("SELECT name FROM pragma_table_info('jobs')").rows.size(), 5U);
  EXPECT_GT(database.Query("SELECT name FROM sqlite_schema WHERE type = 'view'").rows.size(), 5U);
}

TEST_F(ReadOnly, MissingFileIsNotCreated) {
  ExpectError([&] { ReadOnlyDatabase{folder_ / "no.sqlite"}; }, StoreErrorCode::kNotFound);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "no.sqlite"));
}

TEST_F(ReadOnly, ForeignNewerAndOlderFilesAreRefused) {
  const auto other = folder_ / "other.sqlite";
  {
    Connection connection(other, Connection::Mode::kReadWriteCreate);
    connection.Execute("CREATE TABLE theirs (x)");
  }
  ExpectError([&] { ReadOnlyDatabase{other}; }, StoreErrorCode::kNotLegopt);
  {
    Connection connection(other, Connection::Mode::kReadWriteCreate);
    connection.Execute("DROP TABLE theirs");
    Migrate(connection, Migrations().first(1));
  }
  ExpectError([&] { ReadOnlyDatabase{other}; }, StoreErrorCode::kOlderSchema);
  {
    Connection connection(other, Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA user_version = 99");
  }
  ExpectError([&] { ReadOnlyDatabase{other}; }, StoreErrorCode::kNewerSchema);
}

TEST_F(ReadOnly, AMissingTableNamesTheNearestAndAll) {
  ReadOnlyDatabase database(path_);
  try {
    database.Query("SELECT * FROM joblist");
    ADD_FAILURE();
  } catch (const StoreError& error) {
    const std::string message = error.what();
    for (const char* word : {"no such table: joblist", "did you mean 'job_list'?", "views: benchmark_cells",
                             "experiment_list", "tables: attempts", "waypoints"}) {
      EXPECT_NE(message.find(word), std::string::npos) << word << ": " << message;
    }
  }
}

TEST_F(ReadOnly, ATimeLimitOfNothingIsNone) {
  ReadOnlyDatabase database(path_);
  QueryLimits limits;
  limits.time_limit = std::chrono::milliseconds(0);
  EXPECT_EQ(database.Query("SELECT 1", {}, limits).rows.size(), 1U);
  limits.time_limit = std::chrono::milliseconds(200);
  try {
    database.Query("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n", {},
                   limits);
    ADD_FAILURE();
  } catch (const StoreError& error) {
    EXPECT_NE(std::string(error.what()).find("stopped after 0.2 s"), std::string::npos) << error.what();
  }
}

// What somebody did to the schema is told in words about the file, by every way to open it.
TEST_F(ReadOnly, ADatabaseThatLacksSomethingIsNotIntact) {
  struct Case {
    const char* change;
    const char* word;
  };
  for (const auto& [change, word] :
       {Case{"DROP TABLE waypoints", "table 'waypoints' is missing"},
        Case{"DROP TABLE experiment_tags", "table 'experiment_tags' is missing"},
        Case{"DROP VIEW job_list", "view 'job_list' is missing"},
        Case{"DROP TRIGGER results_stay", "trigger 'results_stay' is missing"},
        Case{"ALTER TABLE workers RENAME COLUMN build TO built", "column 'build' of table 'workers' is missing"},
        Case{"PRAGMA user_version = 1", "cannot be upgraded from schema version 1"},
        Case{"PRAGMA user_version = -1", "its schema version is -1"}}) {
    store_.reset();
    const auto copy = folder_ / "copy.sqlite";
    std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
    {
      Connection connection(copy, Connection::Mode::kReadWriteCreate);
      connection.Execute(change);
    }
    const auto expect_told = [&, word = word](const std::function<void()>& open) {
      try {
        open();
        ADD_FAILURE() << word << ": opened";
      } catch (const StoreError& error) {
        EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << error.what();
        EXPECT_NE(std::string(error.what()).find("copy.sqlite: not an intact legopt database: "), std::string::npos)
            << error.what();
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
        EXPECT_EQ(std::string(error.what()).find("legopt-audit"), std::string::npos) << error.what();
      }
    };
    expect_told([&] { OpenSqliteStore(copy); });
    if (std::string(change) == "PRAGMA user_version = 1") continue;  // to readers it is an older file
    expect_told([&] { ReadOnlyDatabase{copy}; });
    expect_told([&] { BackUp(copy, folder_ / "backup.sqlite"); });
  }
}

TEST_F(ReadOnly, InterruptFromAnotherThreadEndsAQuery) {
  ReadOnlyDatabase database(path_);
  std::atomic<bool> done = false;
  std::thread reader([&] {
    ExpectError(
        [&] {
          database.Query("WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n");
        },
        StoreErrorCode::kInterrupted);
    done = true;
  });
  while (!done) {
    database.Interrupt();  // has no effect until the query runs
    std::this_thread::yield();
  }
  reader.join();
}

}  // namespace
}  // namespace legopt::db
