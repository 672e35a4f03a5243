// Databases of every released schema are upgraded with all their rows. A process that ends anywhere within an upgrade
// leaves the old or the new schema, never a mixture. Files of newer releases are not changed. Acceptance figure 21.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>

#include "db/audit.h"
#include "db/backup.h"
#include "db/migrations.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/faulty_vfs.h"
#include "tests/db/fixtures.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

constexpr int kReleased[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};

std::string Schema(const std::filesystem::path& path) {
  Connection connection(path, Connection::Mode::kReadOnly);
  return connection.QueryText(
      "SELECT group_concat(sql, char(10)) FROM (SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL ORDER BY type, "
      "name)");
}

std::string Rows(const std::filesystem::path& path) {
  Connection connection(path, Connection::Mode::kReadOnly);
  return connection.QueryText(
      "SELECT group_concat(line, char(10)) FROM ("
      "SELECT 'job ' || job_id || state || attempts || returned || max_attempts AS line FROM jobs UNION ALL "
      "SELECT 'attempt ' || job_id || attempt || worker_id || token || outcome || coalesce(exit_signal, '-') || "
      "message "
      "|| log_tail FROM attempts UNION ALL "
      "SELECT 'result ' || job_id || attempt || solver_status || wall_us || verdict_literal || coalesce(cost, '-') "
      "FROM "
      "results UNION ALL SELECT 'waypoint ' || job_id || waypoint || hex(x) FROM waypoints UNION ALL "
      "SELECT 'stale ' || job_id || attempt || reason FROM stale_results UNION ALL "
      "SELECT 'experiment ' || experiment_id || state || spec_json FROM experiments UNION ALL "
      "SELECT 'method ' || method_id || name || hash FROM methods UNION ALL "
      "SELECT 'event ' || event_id || kind || detail FROM events)");
}

class Released : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { MakeReleased(GetParam(), path_); }
  TemporaryFolder folder_{TemporaryFolder::Place::kMemory};  // memory: hundreds of upgrades must not wait for a
                                                             // disk
  std::filesystem::path path_ = folder_ / "results.sqlite";
};

class DeathInAnUpgrade : public Released {};

TEST_P(Released, SchemaFilesHaveNotChangedSinceTheirRelease) {
  Connection fresh(folder_ / "fresh.sqlite", Connection::Mode::kReadWriteCreate);
  Migrate(fresh, Migrations().first(static_cast<std::size_t>(GetParam())));
  EXPECT_EQ(Schema(path_), Schema(folder_ / "fresh.sqlite"));
}

TEST_P(Released, IsUpgradedWithAllItsRows) {
  const std::string before = Rows(path_);
  { OpenSqliteStore(path_); }
  EXPECT_EQ(Rows(path_), before);
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
  EXPECT_EQ(Rows(folder_ / "copy.sqlite"), Rows(path_));
}

// The process ends once at every call of the upgrade that changes the disk.
TEST_P(DeathInAnUpgrade, AnywhereLeavesOldOrNew) {
  const std::string before = Rows(path_);
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
      Connection whole(folder_ / ("whole" + std::to_string(version) + ".sqlite"), Connection::Mode::kReadWriteCreate);
      Migrate(whole, Migrations().first(static_cast<std::size_t>(version)));
      EXPECT_EQ(Schema(path), Schema(whole.path())) << "death before call " << call;
      EXPECT_EQ(Rows(path), before);
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
// From the first version, an upgrade passes every step.
INSTANTIATE_TEST_SUITE_P(Versions, DeathInAnUpgrade, testing::Values(kReleased[0], kReleased[std::size(kReleased) - 1]),
                         [](const auto& parameter) { return "Version" + std::to_string(parameter.param); });

// The fixtures' first experiment has a result without a verdict by the physical rule, which version 7 introduced.
TEST_P(Released, ExperimentsWithoutSolidVerdictsKeepTheOriginalRule) {
  const auto store = OpenSqliteStore(path_);
  const OpenState state = store->LoadOpenState();
  EXPECT_EQ(state.experiments.at(0).rule, Rule::kLiteral);
  EXPECT_EQ(state.experiments.at(0).solved, 1);
  EXPECT_EQ(state.experiments.at(1).rule, Rule::kSolid) << "no results yet";
}

TEST(Migrations, EveryVersionBeforeThisOneHasAFixture) {
  EXPECT_GE(std::size(kReleased) + 1, static_cast<std::size_t>(SchemaVersion()))
      << "add tests/db/fixtures/version_N.sql, made as the others, and its number above";
}

// Version 9 removes a list of allowed words: values refused before are accepted, and texts that are no word are still
// refused.
TEST(Migrations, CollisionModelsAreNotListedAnyMore) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  MakeReleased(8, path);
  const auto set = [&](const std::string& word) {
    Connection connection(path, Connection::Mode::kReadWriteCreate);
    connection.Execute("UPDATE methods SET collision = '" + word + "'");
  };
  EXPECT_THROW(set("surface_oriented"), StoreError);
  { OpenSqliteStore(path); }
  EXPECT_NO_THROW(set("surface_oriented"));
  for (const char* word : {"", "Surface", "a-b"}) EXPECT_THROW(set(word), StoreError) << word;
  Connection connection(path, Connection::Mode::kReadOnly);
  EXPECT_EQ(connection.QueryText("PRAGMA integrity_check"), "ok");
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
