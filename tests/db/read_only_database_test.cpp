#include "db/read_only_database.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <set>
#include <thread>

#include "db/audit.h"
#include "db/backup.h"
#include "db/connection.h"
#include "db/file_state.h"
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
    Migrate(connection);
    connection.Execute("PRAGMA user_version = " + std::to_string(SchemaVersion() - 1));
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

// Changes to the schema are reported as an error of the file by every way of opening it.
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
        Case{"PRAGMA user_version = 9", "cannot be upgraded from schema version 9"},
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
    const std::string_view altered = change;
    expect_told([&] { BackUp(copy, folder_ / "backup.sqlite"); });
    // Readers regard a file of an older version as sound; they ask for its upgrade.
    if (altered != "PRAGMA user_version = 9") expect_told([&] { ReadOnlyDatabase{copy}; });
    if (altered != "DROP VIEW job_list") expect_told([&] { OpenSqliteStore(copy); });  // the server restores views
  }
}

// Known names with different definitions, and entries that would be executed or trusted, are refused. All other
// objects of a user are accepted.
TEST_F(ReadOnly, ASchemaThatSaysSomethingElseIsNotIntact) {
  struct Case {
    const char* change = nullptr;
    const char* word = nullptr;
    const char* word_of_server = word;
  };
  for (const auto& [change, word, word_of_server] :
       {Case{"CREATE TRIGGER t AFTER INSERT ON experiment_tags BEGIN UPDATE experiments SET name = 'x'; END",
             "trigger 't' on table 'experiment_tags' is not legopt's"},
        Case{"DROP VIEW benchmark_table; CREATE VIEW benchmark_table AS SELECT 'SQP' AS method, 100 AS solved",
             "view 'benchmark_table' is not that of schema version", nullptr},  // the server restores views
        Case{"DROP TRIGGER results_stay; CREATE TRIGGER results_stay BEFORE DELETE ON results BEGIN SELECT 1; END",
             "trigger 'results_stay' is not that of schema version"},
        Case{"DROP VIEW failures; CREATE TABLE failures (x)", "view 'failures' is missing",
             "table 'failures' on table 'failures' is not legopt's"},
        Case{"CREATE TABLE mine (x); CREATE TRIGGER mine_too INSTEAD OF INSERT ON failures BEGIN SELECT 1; END",
             "trigger 'mine_too' on table 'failures' is not legopt's"},
        Case{"ALTER TABLE jobs ADD COLUMN mine TEXT", "table 'jobs' is not that of schema version"},
        Case{"DROP INDEX open_jobs_by_cell; CREATE INDEX open_jobs_by_cell ON jobs (cell_id)",
             "index 'open_jobs_by_cell' is not that of schema version"},
        Case{"CREATE UNIQUE INDEX mine ON events (kind)", "index 'mine' on table 'events' is not legopt's"},
        Case{
            "CREATE TABLE mine (x UNIQUE); CREATE INDEX m ON mine (x); CREATE INDEX n ON results (cost); CREATE VIEW v "
            "AS SELECT * FROM mine; ANALYZE",
            nullptr}}) {
    store_.reset();
    const auto copy = folder_ / "copy.sqlite";
    std::filesystem::copy_file(path_, copy, std::filesystem::copy_options::overwrite_existing);
    {
      Connection connection(copy, Connection::Mode::kReadWriteCreate);
      connection.Execute(change);
    }
    const auto expect = [](const char* refused, const std::function<void()>& open) {
      std::string told;
      try {
        open();
      } catch (const StoreError& error) {
        told = error.what();
        EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << told;
      }
      EXPECT_EQ(told.empty(), refused == nullptr) << told;
      if (refused != nullptr) {
        EXPECT_NE(told.find(refused), std::string::npos) << refused << "\n" << told;
      }
    };
    expect(word, [&] { ReadOnlyDatabase{copy}; });
    expect(word, [&] { BackUp(copy, folder_ / "backup.sqlite"); });
    const auto defects = Audit(copy);
    EXPECT_EQ(defects.empty(), word == nullptr) << change;
    if (!defects.empty()) {
      EXPECT_EQ(defects.front().rule, "schema") << defects.front().detail;
    }
    expect(word_of_server, [&] { OpenSqliteStore(copy); });
  }
}

// All names that the file system accepts.
TEST_F(ReadOnly, AnyPathCanBeOpened) {
  const TemporaryFolder memory(TemporaryFolder::Place::kMemory);  // memory: dozens of databases must not wait for a
                                                                  // disk
  const std::string folder = std::filesystem::canonical(memory.path()).string();
  std::string deep = folder;
  for (int level = 0; level < 200; ++level) deep += "/d";
  std::filesystem::create_directories(deep);
  std::vector<std::string> paths = {"/" + folder + "/a.sqlite", "//" + folder + "/b.sqlite", folder + "//c.sqlite",
                                    folder + "/./d.sqlite",     folder + "/x/../e.sqlite",   deep + "/f.sqlite"};
  std::filesystem::create_directory(folder + "/x");
  for (const char* name : {"?", "#", "%", "%41", "&", "=", ";", "'", "\"", "\n", "\xfc", " ", "?mode=memory", "a:b",
                           "~", "\\", "-", "*"}) {
    paths.push_back(folder + "/" + name);
  }
  for (const std::string& path : paths) {
    { OpenSqliteStore(path)->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}}); }
    EXPECT_TRUE(std::filesystem::exists(path)) << path;
    EXPECT_EQ(ReadOnlyDatabase(path).Query("SELECT 1 FROM experiments").rows.size(), 1U) << path;
    BackUp(path, path + ".copy");
    EXPECT_TRUE(Audit(path + ".copy").empty()) << path;
  }
  ExpectError([&] { OpenSqliteStore(folder + "/" + std::string(250, 'x') + "/../" + std::string(250, 'y')); },
              StoreErrorCode::kUnwritable);
}

TEST_F(ReadOnly, AReaderLeavesNoFilesBesideAClosedDatabase) {
  store_.reset();
  ASSERT_FALSE(std::filesystem::exists(path_.string() + "-wal"));
  std::filesystem::create_symlink("results.sqlite", folder_ / "link.sqlite");
  const auto written = std::filesystem::last_write_time(path_);
  const std::function<void(const std::filesystem::path&)> readers[] = {
      [](const auto& file) { ReadOnlyDatabase(file).Query("SELECT 1 FROM experiments"); },
      [](const auto& file) { Audit(file); },
      [this](const auto& file) {
        BackUp(file, folder_ / "copy.sqlite");
        std::filesystem::remove(folder_ / "copy.sqlite");
      }};
  for (const auto& read : readers) {
    for (const char* name : {"results.sqlite", "link.sqlite"}) {
      read(folder_ / name);
      std::set<std::string> names;
      for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
        names.insert(entry.path().filename().string());
      }
      EXPECT_EQ(names, (std::set<std::string>{"link.sqlite", "results.sqlite"}));
    }
  }
  EXPECT_EQ(std::filesystem::last_write_time(path_), written);
}

TEST_F(ReadOnly, AReaderRemovesTheLogOfNobodyElse) {
  const auto side_files_exist = [&] {
    return std::filesystem::exists(path_.string() + "-wal") && std::filesystem::exists(path_.string() + "-shm");
  };
  ReadOnlyDatabase(path_).Query("SELECT 1 FROM experiments");
  EXPECT_TRUE(side_files_exist()) << "a server writes";
  store_->CheckPlace();
  store_.reset();
  {
    ReadOnlyDatabase database(path_);
    database.Query("SELECT 1 FROM experiments");
    store_ = OpenSqliteStore(path_);  // begins while a reader has the file open
  }
  EXPECT_TRUE(side_files_exist());
  store_->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(2, 5, 3)}});
  EXPECT_EQ(ReadOnlyDatabase(path_).Query("SELECT 1 FROM experiments").rows.size(), 2U);
  store_.reset();
  { const std::ofstream left_by_another_program(path_.string() + "-wal"); }
  ReadOnlyDatabase(path_).Query("SELECT 1 FROM experiments");
  EXPECT_TRUE(std::filesystem::exists(path_.string() + "-wal"));
}

// SQLite cannot create its side file there.
TEST_F(ReadOnly, ADatabaseInAFolderThatCannotBeWrittenIsRead) {
  if (geteuid() == 0) GTEST_SKIP() << "root can write everywhere";
  store_.reset();
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_EQ(ReadOnlyDatabase(path_).Query("SELECT 1 FROM experiments").rows.size(), 1U);
  EXPECT_FALSE(std::filesystem::exists(path_.string() + "-shm"));
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::owner_all);
}

TEST_F(ReadOnly, ALogInAFolderThatCannotBeWrittenIsReadInACopy) {
  const auto folder = folder_ / "closed";
  std::filesystem::create_directory(folder);
  for (const char* suffix : {"", "-wal"}) {
    std::filesystem::copy_file(path_.string() + suffix, folder.string() + "/results.sqlite" + suffix);
  }
  const PrivateCopy copy(folder / "results.sqlite");
  EXPECT_EQ(ReadOnlyDatabase(copy.path()).Query("SELECT 1 FROM experiments").rows.size(), 1U);
  if (geteuid() == 0) return;  // root can write everywhere
  std::filesystem::permissions(folder, std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_EQ(ReadOnlyDatabase(folder / "results.sqlite").Query("SELECT 1 FROM experiments").rows.size(), 1U);
  EXPECT_FALSE(std::filesystem::exists(folder.string() + "/results.sqlite-shm"));
  std::filesystem::permissions(folder, std::filesystem::perms::owner_all);
}

// The effective user of this process; root again at the end.
class AsUser {
 public:
  explicit AsUser(uid_t user) { EXPECT_EQ(::seteuid(user), 0); }
  ~AsUser() { EXPECT_EQ(::seteuid(0), 0); }
  AsUser(const AsUser&) = delete;
  AsUser& operator=(const AsUser&) = delete;
};

// Its owner could not open the database any more.
TEST_F(ReadOnly, AReaderLeavesNoSideFilesBesideTheFileOfAnotherUser) {
  if (geteuid() != 0) GTEST_SKIP() << "needs two users";
  constexpr uid_t kOwner = 1001, kReader = 54321;
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::all);
  const char* const usual = std::getenv("TMPDIR");
  const std::string usual_tmpdir = usual != nullptr ? usual : "/tmp";
  ::setenv("TMPDIR", folder_.path().c_str(), 1);  // writable for both
  const auto shared = folder_ / "shared";
  const std::string file = shared / "results.sqlite";
  for (const bool with_log : {true, false}) {
    std::filesystem::create_directory(shared);
    std::filesystem::permissions(shared, std::filesystem::perms::all);
    if (!with_log) store_.reset();  // moves the log into the file
    for (const char* suffix : {"", "-wal"}) {
      if (!std::filesystem::exists(path_.string() + suffix)) continue;
      std::filesystem::copy_file(path_.string() + suffix, file + suffix);
      EXPECT_EQ(::chown((file + suffix).c_str(), kOwner, kOwner), 0);
    }
    EXPECT_EQ(std::filesystem::exists(file + "-wal"), with_log);
    {
      const AsUser reader(kReader);
      EXPECT_EQ(ReadOnlyDatabase(file).Query("SELECT 1 FROM experiments").rows.size(), 1U);
    }
    EXPECT_FALSE(std::filesystem::exists(file + "-shm"));
    EXPECT_EQ(std::filesystem::exists(file + "-wal"), with_log);
    {
      const AsUser owner(kOwner);
      OpenSqliteStore(file)->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(2, 5, 3)}});
    }
    std::filesystem::remove_all(shared);
  }
  ::setenv("TMPDIR", usual_tmpdir.c_str(), 1);
}

// The error names the file that is closed, and the cause.
TEST_F(ReadOnly, APartThatCannotBeReadIsNamed) {
  const auto folder = folder_ / "closed";
  std::filesystem::create_directory(folder);
  const std::string file = folder / "results.sqlite";
  std::filesystem::copy_file(path_, file);
  std::filesystem::create_symlink("/nowhere", file + "-wal");  // root reads every file that exists
  try {
    const PrivateCopy copy(file);
    ADD_FAILURE();
  } catch (const StoreError& error) {
    EXPECT_EQ(error.code(), StoreErrorCode::kUnwritable);
    EXPECT_NE(std::string(error.what()).find("results.sqlite-wal: cannot be read: No such file"), std::string::npos)
        << error.what();
  }
}

TEST_F(ReadOnly, AnUnknownWordIsPrintable) {
  store_.reset();
  {
    Connection connection(path_, Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA ignore_check_constraints = 1; UPDATE jobs SET state = char(0, 27) || 'x'");
    Statement read(connection, "SELECT state FROM jobs", false);
    ASSERT_TRUE(read.Step());
    try {
      read.column_enum<JobState>(0);
      ADD_FAILURE();
    } catch (const StoreError& error) {
      EXPECT_NE(std::string(error.what()).find("the unknown word '??x'; restore a backup"), std::string::npos)
          << error.what();
    }
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
