// Databases of every schema version since 9 are upgraded with all their rows. A process that ends anywhere within an
// upgrade leaves the old or the new schema, never a mixture. Files of older and newer versions are not changed.
// Acceptance figure 21.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <functional>
#include <map>
#include <regex>

#include "db/audit.h"
#include "db/backup.h"
#include "db/migrations.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "legopt/math/blake2b.h"
#include "tests/db/faulty_vfs.h"
#include "tests/db/fixtures.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

constexpr int kReleased[] = {9, 10, 11, 12, 13, 14, 15, 16};

// Without comments and white space, in which new and upgraded files differ. No quoted text of the schema has either.
std::string WithoutComments(const std::string& sql) { return std::regex_replace(sql, std::regex("--[^\n]*|\\s+"), ""); }

std::string Schema(const std::filesystem::path& path) {
  Connection connection(path, Connection::Mode::kReadOnly);
  return WithoutComments(
      connection.QueryText("SELECT group_concat(sql, char(10)) FROM (SELECT sql FROM sqlite_schema WHERE sql IS NOT "
                           "NULL ORDER BY type, name)"));
}

constexpr int kVersionOfViolations = 13;

// Columns of `results` whose values the upgrade to version 13 moved to `violations`.
constexpr char kMovedColumns[] =
    "'foot_violation', 'com_violation_m', 'limit_violation', 'environment_depth_m', 'self_depth_literal_m', "
    "'self_depth_strict_m', 'solid_depth_m', 'longest_step_m'";

// Selects every stored value of every table with its type, one row a line, except the session of the writer and the
// moved columns.
std::string SelectAll(const std::filesystem::path& path) {
  Connection connection(path, Connection::Mode::kReadOnly);
  return connection.QueryText(
      "SELECT group_concat('SELECT ' || quote(t.name) || ' AS place, ' || values_of || ' AS line FROM ' || t.name, "
      "' UNION ALL ') || ' ORDER BY 1, 2' FROM (SELECT s.name, (SELECT group_concat('typeof(' || c.name || ') || "
      "quote(' || c.name || ')', ' || ') FROM pragma_table_info(s.name) AS c WHERE s.name <> 'results' OR c.name NOT "
      "IN (" +
      std::string(kMovedColumns) +
      ")) AS values_of FROM sqlite_schema AS s WHERE s.type = 'table' AND s.name <> 'file_state') AS t");
}

std::string Rows(const std::filesystem::path& path, const std::string& select_all) {
  Connection connection(path, Connection::Mode::kReadOnly);
  return connection.QueryText("SELECT group_concat(place || line, char(10)) FROM (" + select_all + ")");
}

class Released : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { MakeReleased(GetParam(), path_); }
  TemporaryFolder folder_{TemporaryFolder::Place::kMemory};  // memory: hundreds of upgrades must not wait for a
                                                             // disk
  std::filesystem::path path_ = folder_ / "results.sqlite";
};

class DeathInAnUpgrade : public Released {};
class WithMovedColumns : public Released {};

TEST_P(Released, IsUpgradedWithAllItsRows) {
  const std::string select_all = SelectAll(path_), before = Rows(path_, select_all);
  EXPECT_GT(std::count(before.begin(), before.end(), '\n'), 20);
  { OpenSqliteStore(path_); }
  EXPECT_EQ(Rows(path_, select_all), before);
  { OpenSqliteStore(folder_ / "fresh.sqlite"); }
  EXPECT_EQ(Schema(path_), Schema(folder_ / "fresh.sqlite"));
  for (const AuditDiagnostic& defect : Audit(path_)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
  ReadOnlyDatabase database(path_);
  for (const char* view :
       {"benchmark_table", "benchmark_cells", "job_list", "failures", "disagreements", "experiment_list",
        "interpolation_cells", "result_origins", "clock_stopped", "reusable_results"}) {
    EXPECT_NO_THROW(database.Query("SELECT * FROM " + std::string(view), 100)) << view;
  }
}

TEST_P(WithMovedColumns, KeepsTheFiguresOfTheJudgeAsViolations) {
  constexpr char kChecks[][2][40] = {
      {"foot_violation", "foot_pose"},           {"com_violation_m", "com"},
      {"limit_violation", "joint_limit"},        {"environment_depth_m", "environment_collision"},
      {"self_depth_strict_m", "self_collision"}, {"longest_step_m", "step"}};
  const auto values = [&](const std::string& sql) {
    Connection connection(path_, Connection::Mode::kReadOnly);
    return connection.QueryText("SELECT coalesce(group_concat(job_id || ' ' || value, ', '), '') FROM (" + sql +
                                " ORDER BY 1)");
  };
  std::map<std::string, std::string> before;
  for (const auto& [column, check] : kChecks) {
    before[check] =
        values(std::string("SELECT job_id, ") + column + " AS value FROM results WHERE " + column + " >= 0");
  }
  EXPECT_NE(before["foot_pose"], "");
  const std::string solid = values("SELECT job_id, solid_depth_m AS value FROM results WHERE solid_depth_m >= 0");
  { OpenSqliteStore(path_); }
  for (const auto& [check, expected] : before) {
    EXPECT_EQ(values("SELECT job_id, max(value) AS value FROM violations WHERE check_name = '" + check +
                     "' AND rule <> iif(check_name = 'step', '', 'solid') GROUP BY job_id"),
              expected)
        << check;
  }
  EXPECT_EQ(values("SELECT job_id, solid_depth_m AS value FROM job_list WHERE solid_depth_m IS NOT NULL AND job_id IN "
                   "(SELECT job_id FROM results WHERE verdict_solid IS NOT NULL)"),
            solid);
}

TEST_P(Released, GoesOnWithItsOpenExperiment) {
  const auto store = OpenSqliteStore(path_);
  const OpenState state = store->LoadOpenState();
  ASSERT_EQ(state.experiments.size(), 2U);
  ASSERT_EQ(state.open.size(), 1U);
  EXPECT_EQ(state.open[0].jobs[0].state, JobState::kLeased);
  EXPECT_EQ(state.open[0].jobs[0].token, 501);
  EXPECT_EQ(state.open[0].jobs[1].returned, 1);
  store->Apply(std::vector<StoreOp>{AcceptResult{5, 1, SampleResult(), "", "", 50}, LeaseJob{6, 2, 602, 1, 51}});
  EXPECT_EQ(store->FindAttempt(6, 2)->token, 602);
}

TEST_P(Released, CanBeBackedUpByThisRelease) {
  const BackupReport report = BackUp(path_, folder_ / "copy.sqlite");
  EXPECT_EQ(report.schema_version, GetParam());
  EXPECT_EQ(report.jobs, 6);
  const std::string select_all = SelectAll(path_);
  EXPECT_EQ(SelectAll(folder_ / "copy.sqlite"), select_all);
  EXPECT_EQ(Rows(folder_ / "copy.sqlite", select_all), Rows(path_, select_all));
  EXPECT_EQ(Schema(folder_ / "copy.sqlite"), Schema(path_));
}

// Whatever differs from the schema of the file's version shows in the upgraded schema, and nothing is upgraded then.
TEST_P(Released, AnAlteredFileIsLeftAlone) {
  struct Case {
    const char* change;
    const char* word;
  };
  for (const auto& [change, word] :
       {Case{"DROP TABLE stale_results", "stale_results"},
        Case{"DROP TRIGGER results_stay", "trigger 'results_stay' is missing"},
        Case{"ALTER TABLE jobs ADD COLUMN mine TEXT", "table 'jobs' is not that of schema version "},
        Case{"CREATE TRIGGER t AFTER UPDATE ON experiments BEGIN UPDATE experiments SET name = 'x'; END",
             "trigger 't' on table 'experiments' is not legopt's"}}) {
    const auto path = folder_ / "altered.sqlite", copy = folder_ / "copy.sqlite";
    std::filesystem::remove(path);
    MakeReleased(GetParam(), path);
    {
      Connection connection(path, Connection::Mode::kReadWriteCreate);
      connection.Execute(change);
    }
    const std::string schema = Schema(path), select_all = SelectAll(path), before = Rows(path, select_all);
    const auto expect_refused = [&, word = word](const std::function<void()>& use) {
      try {
        use();
        ADD_FAILURE() << word;
      } catch (const StoreError& error) {
        EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << error.what();
        EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("altered.sqlite: not an intact"), std::string::npos) << error.what();
      }
    };
    expect_refused([&] { BackUp(path, copy); });
    EXPECT_FALSE(std::filesystem::exists(copy));
    expect_refused([&] { OpenSqliteStore(path); });
    EXPECT_EQ(Schema(path), schema);
    EXPECT_EQ(Rows(path, select_all), before);
    Connection connection(path, Connection::Mode::kReadOnly);
    EXPECT_EQ(connection.QueryInt("PRAGMA user_version"), GetParam());
  }
}

// The process ends once at every call of the upgrade that changes the disk.
TEST_P(DeathInAnUpgrade, AnywhereLeavesOldOrNew) {
  const std::string select_all = SelectAll(path_), before = Rows(path_, select_all), schema = Schema(path_);
  { OpenSqliteStore(folder_ / "fresh.sqlite"); }
  const std::string new_schema = Schema(folder_ / "fresh.sqlite");
  for (std::int64_t call = 1;; ++call) {
    std::filesystem::path path = folder_ / ("crash" + std::to_string(call) + ".sqlite");
    std::filesystem::copy_file(path_, path);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      FaultyVfs vfs;
      vfs.Arm(FaultyVfs::Fault::kDie, call);
      OpenSqliteStore(path);
      _exit(0);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFEXITED(status));
    {
      Connection connection(path, Connection::Mode::kReadWriteCreate);
      const std::int64_t version = connection.QueryInt("PRAGMA user_version");
      EXPECT_EQ(connection.QueryText("PRAGMA integrity_check"), "ok");
      EXPECT_TRUE(version == GetParam() || version == SchemaVersion()) << version;
      EXPECT_EQ(Schema(path), version == GetParam() ? schema : new_schema) << "death before call " << call;
      EXPECT_EQ(Rows(path, select_all), before);
    }
    { OpenSqliteStore(path); }
    for (const AuditDiagnostic& defect : Audit(path))
      ADD_FAILURE() << call << ": " << defect.rule << ": " << defect.detail;
    std::filesystem::remove(path);
    if (WEXITSTATUS(status) == 0 || HasFailure()) {
      RecordProperty("calls", static_cast<int>(call - 1));
      EXPECT_GT(call, GetParam() < SchemaVersion() ? 10 : 0);
      return;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, Released, testing::ValuesIn(kReleased),
                         [](const auto& parameter) { return "Version" + std::to_string(parameter.param); });
INSTANTIATE_TEST_SUITE_P(Versions, WithMovedColumns, testing::Range(kReleased[0], kVersionOfViolations),
                         [](const auto& parameter) { return "Version" + std::to_string(parameter.param); });
// From the oldest version, an upgrade passes every step.
INSTANTIATE_TEST_SUITE_P(Versions, DeathInAnUpgrade, testing::Values(kReleased[0], kReleased[std::size(kReleased) - 1]),
                         [](const auto& parameter) { return "Version" + std::to_string(parameter.param); });

// The fixtures' first experiment has a result without a verdict by the solid rule, which version 7 introduced.
TEST_P(Released, ExperimentsWithoutSolidVerdictsKeepTheOriginalRule) {
  const auto store = OpenSqliteStore(path_);
  const OpenState state = store->LoadOpenState();
  EXPECT_EQ(state.experiments.at(0).rule, Rule::kLiteral);
  EXPECT_EQ(state.experiments.at(0).solved, 1);
  EXPECT_EQ(state.experiments.at(1).rule, Rule::kSolid) << "no results yet";
}

TEST(Migrations, TablesStateTheirAddedColumns) {
  const std::vector<AddedColumn> columns = AddedColumns(R"(-- since 3
CREATE TABLE a (
  x INTEGER,  -- the first
  -- since 4
  y TEXT CHECK (y <> ','
    AND y <> 'b'),  -- since 5: by one build
  z REAL,  -- since 12
  CHECK (x > 0)
) STRICT;
CREATE TABLE b (
  x INTEGER  -- since 7
) STRICT;
CREATE INDEX i ON a (x,
  y);
)");
  std::vector<std::string> found;
  for (const AddedColumn& column : columns) {
    found.push_back(std::to_string(column.since) + " " + column.table + ": " + column.definition);
  }
  EXPECT_EQ(found,
            (std::vector<std::string>{"5 a: y TEXT CHECK (y <> ',' AND y <> 'b')", "12 a: z REAL", "7 b: x INTEGER"}));
}

TEST(Migrations, EveryVersionBeforeThisOneHasAFixture) {
  EXPECT_EQ(kReleased[0], OldestSchemaVersion());
  EXPECT_EQ(kReleased[0] + std::ssize(kReleased), SchemaVersion())
      << "add tests/db/fixtures/version_N.sql, made as the others, and its number above";
}

// Readers of another build of the same version accept exactly this schema.
TEST(Migrations, TheSchemaChangesOnlyWithItsVersion) {
  const TemporaryFolder folder;
  { OpenSqliteStore(folder / "results.sqlite"); }
  EXPECT_EQ(SchemaVersion(), 17);
  EXPECT_EQ(Blake2bHex(Schema(folder / "results.sqlite"), 16), "f90ac05c4bb77119a07ef9986ee43e10")
      << "db/schema/tables.sql or views.sql has changed: write 'since N' after new columns of tables.sql, or add "
         "db/schema/upgrade_from_N.sql (it may be empty if only views have changed); then change this version and "
         "digest";
}

TEST(Migrations, AFailedUpgradeLeavesTheFileAsItWas) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  MakeReleased(9, path);
  {
    Connection connection(path, Connection::Mode::kReadWriteCreate);
    connection.Execute("CREATE TABLE unsolved_waypoints (x)");  // the second upgrade creates it
  }
  const std::string schema = Schema(path);
  try {
    OpenSqliteStore(path);
    ADD_FAILURE() << "opened";
  } catch (const StoreError& error) {
    EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt);
    EXPECT_NE(std::string(error.what()).find("cannot be upgraded from schema version 9"), std::string::npos)
        << error.what();
  }
  EXPECT_EQ(Schema(path), schema);
  {
    Connection connection(path, Connection::Mode::kReadWriteCreate);
    EXPECT_EQ(connection.QueryInt("PRAGMA user_version"), 9);
    connection.Execute("DROP TABLE unsolved_waypoints");
  }
  { OpenSqliteStore(path); }
  EXPECT_TRUE(Audit(path).empty());
}

// A server restores views; readers accept only those of the schema's version.
TEST(Migrations, ViewsAreCreatedAnewAtEachStart) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  { OpenSqliteStore(path); }
  const std::string schema = Schema(path);
  for (const char* change : {"DROP VIEW job_list", "DROP VIEW failures; CREATE VIEW failures AS SELECT 1 AS job_id"}) {
    {
      Connection connection(path, Connection::Mode::kReadWriteCreate);
      connection.Execute(change);
    }
    try {
      ReadOnlyDatabase database(path);
      ADD_FAILURE() << change;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt);
      EXPECT_NE(std::string(error.what()).find("start legopt-server --db"), std::string::npos) << error.what();
    }
    { OpenSqliteStore(path); }
    EXPECT_EQ(Schema(path), schema) << change;
    EXPECT_NO_THROW(ReadOnlyDatabase{path});
  }
}

// A reader goes on while a server starts on the file.
TEST(Migrations, AStartDoesNotDisturbReaders) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  { OpenSqliteStore(path); }
  const auto store = OpenSqliteStore(path);
  Connection reader(path, Connection::Mode::kReadOnly);
  Statement count(reader, "SELECT count(*) FROM job_list");
  ASSERT_TRUE(count.Step());  // holds a snapshot
  {
    Connection server(path, Connection::Mode::kReadWriteCreate);
    Migrate(server);
  }
  EXPECT_FALSE(count.Step());
  count.Reset();
  EXPECT_TRUE(count.Step());
  EXPECT_EQ(reader.QueryInt("SELECT count(*) FROM experiment_list"), 0);
}

// Versions 1 to 8 need an earlier legopt, which every way of opening a file reports.
TEST(Migrations, AFileTooOldToBeUpgradedIsLeftAlone) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  MakeReleased(9, path);
  {
    Connection connection(path, Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA user_version = 8");
    connection.Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  }
  const auto expect_refused = [](const std::function<void()>& use) {
    try {
      use();
      ADD_FAILURE() << "taken";
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kOlderSchema) << error.what();
      EXPECT_NE(std::string(error.what()).find("schema 8, this program upgrades schema 9 and newer"), std::string::npos)
          << error.what();
    }
  };
  const std::string schema = Schema(path);
  expect_refused([&] { OpenSqliteStore(path); });
  expect_refused([&] { ReadOnlyDatabase database(path); });
  expect_refused([&] { Audit(path); });
  expect_refused([&] { BackUp(path, folder / "copy.sqlite"); });
  EXPECT_EQ(Schema(path), schema);
}

TEST(Migrations, ANewerFileIsLeftAlone) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  { OpenSqliteStore(path); }
  {
    Connection connection(path, Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA user_version = " + std::to_string(SchemaVersion() + 1));
    connection.Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  }
  const auto read = [&] {
    std::ifstream file(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(file), {});
  };
  const std::string before = read();
  const auto expect_refused = [](const std::function<void()>& use) {
    try {
      use();
      ADD_FAILURE() << "taken";
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kNewerSchema) << error.what();
    }
  };
  expect_refused([&] { OpenSqliteStore(path); });
  expect_refused([&] { ReadOnlyDatabase database(path); });
  expect_refused([&] { Audit(path); });
  expect_refused([&] { BackUp(path, folder / "copy.sqlite"); });
  EXPECT_EQ(read(), before);
  EXPECT_FALSE(std::filesystem::exists(folder / "copy.sqlite"));
}

}  // namespace
}  // namespace legopt::db
