// kill -9 of the writing process: everything acknowledged is present, nothing is partly written, and no clean-up is
// needed.

#include <gtest/gtest.h>
#include <sched.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <random>

#include "db/connection.h"
#include "db/migrations.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

// Opens the store (creating or recovering it), continues from its state, and writes one byte to `pipe` per commit.
// Each commit leases two jobs and stores results for both: half of a commit must never be visible. Never returns.
[[noreturn]] void WriteForEver(const std::filesystem::path& path, int pipe) {
  const auto store = OpenSqliteStore(path);
  std::int64_t next = 1;
  const OpenState state = store->LoadOpenState();
  if (state.experiments.empty()) {
    store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1, 5000)}, PutWorker{SampleWorker(1)}});
  } else {
    next = state.experiments[0].jobs_by_state[JobState::kDone] + 1;
  }
  ResultRecord result = SampleResult();
  result.waypoints.assign(3 * 40, 0.5);
  for (;; next += 2) {
    std::vector<StoreOp> ops;
    for (std::int64_t job = next; job < next + 2; ++job) {
      ops.emplace_back(LeaseJob{job, 1, job, 1, 1});
      ops.emplace_back(AcceptResult{job, 1, result, "", "log", 2});
    }
    store->Apply(ops);
    const char acknowledgement = 'k';
    if (write(pipe, &acknowledgement, 1) != 1) _exit(1);
  }
}

TEST(Crash, AcknowledgedCommitsSurviveKill9AtAnyPoint) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  std::mt19937_64 random(20240607);
  std::int64_t acknowledged = 0;
  constexpr int kKills = 40;
  for (int kill_number = 0; kill_number < kKills; ++kill_number) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    // The child is forked before any database is open in this process.
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      close(ends[0]);
      WriteForEver(path, ends[1]);
    }
    close(ends[1]);
    // Kills after a random number of commits, at a random point of the next one, sometimes during opening or recovery.
    const std::uint64_t commits = random() % 30;
    char byte = 0;
    for (std::uint64_t i = 0; i < commits && read(ends[0], &byte, 1) == 1; ++i) ++acknowledged;
    for (std::uint64_t spin = random() % 300'000; spin > 0; --spin) asm volatile("");
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    while (read(ends[0], &byte, 1) == 1) ++acknowledged;
    close(ends[0]);

    Connection connection(path, Connection::Mode::kReadWriteCreate);
    ASSERT_EQ(connection.QueryText("PRAGMA integrity_check"), "ok") << "kill " << kill_number;
    ASSERT_EQ(connection.QueryInt("SELECT count(*) FROM pragma_foreign_key_check"), 0);
    if (connection.QueryInt("SELECT count(*) FROM sqlite_schema WHERE name = 'jobs'") == 0) continue;
    const std::int64_t done = connection.QueryInt("SELECT count(*) FROM jobs WHERE state = 'done'");
    EXPECT_GE(done, 2 * acknowledged);
    EXPECT_EQ(done % 2, 0) << "half of a commit";
    EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM jobs WHERE state = 'leased'"), 0);
    EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM results"), done);
    EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM waypoints"), 40 * done);
  }
  EXPECT_GT(acknowledged, 0);
}

TEST(Crash, KilledCreationLeavesNothingOrAll) {
  std::mt19937_64 random(7);
  constexpr int kKills = 25;
  for (int kill_number = 0; kill_number < kKills; ++kill_number) {
    const TemporaryFolder folder;
    const auto path = folder / "results.sqlite";
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      OpenSqliteStore(path);
      _exit(0);
    }
    for (std::uint64_t spin = random() % 20'000'000; spin > 0; --spin) asm volatile("");
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    {
      Connection connection(path, Connection::Mode::kReadWriteCreate);
      const std::int64_t version = connection.QueryInt("PRAGMA user_version");
      const std::int64_t tables = connection.QueryInt("SELECT count(*) FROM sqlite_schema WHERE name = 'jobs'");
      const std::int64_t views = connection.QueryInt("SELECT count(*) FROM sqlite_schema WHERE name = 'failures'");
      EXPECT_TRUE(version == 0 || version == SchemaVersion()) << version;
      EXPECT_EQ(tables, version == 0 ? 0 : 1);
      EXPECT_EQ(views, version == 0 ? 0 : 1);
    }
    OpenSqliteStore(path);  // opens without clean-up
  }
}

constexpr int kNoSmallDisk = 77;

// Mounts a disk of `megabytes` on the folder, visible to this process only; its size may be changed later.
bool MountSmallDisk(const std::filesystem::path& folder, int megabytes, unsigned long flags = 0) {
  const std::string size = "size=" + std::to_string(megabytes) + "m";
  return mount("none", folder.c_str(), "tmpfs", flags, size.c_str()) == 0;
}

// Runs in a child. Returns the number of the failed check, 0 if none failed, kNoSmallDisk if no disk can be mounted.
int FillTheDisk(const std::filesystem::path& path) {
  constexpr int kSmall = 4, kAmple = 200;
  if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return kNoSmallDisk;
  if (!MountSmallDisk(path.parent_path(), kSmall)) return kNoSmallDisk;
  const auto store = OpenSqliteStore(path);
  store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1, 2000)}, PutWorker{SampleWorker(1)}});
  ResultRecord result = SampleResult();
  result.waypoints.assign(3 * 1000, 0.5);
  std::vector<StoreOp> ops;
  std::int64_t job = 0;
  try {
    while (++job < 4000) {
      ops = {LeaseJob{job, 1, job, 1, 1}, AcceptResult{job, 1, result, "", "", 2}};
      store->Apply(ops);
    }
    return 1;  // the disk was never full
  } catch (const StoreError& error) {
    if (!error.transient()) return 2;
  }
  // Reading still works, and only acknowledged data are present.
  const OpenState state = store->LoadOpenState();
  if (state.experiments.at(0).jobs_by_state[JobState::kDone] != job - 1) return 3;
  try {
    store->Apply(ops);
    return 4;  // still full
  } catch (const StoreError& error) {
    if (!error.transient()) return 5;
  }
  if (!MountSmallDisk(path.parent_path(), kAmple, MS_REMOUNT)) return 8;
  store->Apply(ops);  // the identical transaction, once there is space
  if (store->LoadOpenState().experiments.at(0).jobs_by_state[JobState::kDone] != job) return 6;
  Connection connection(path, Connection::Mode::kReadWriteCreate);
  return connection.QueryText("PRAGMA integrity_check") == "ok" ? 0 : 9;
}

TEST(Crash, FullDiskIsAStateThatPasses) {
  const TemporaryFolder folder;
  const auto path = folder / "results.sqlite";
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    int fault = 7;
    try {
      fault = FillTheDisk(path);
    } catch (const std::exception&) {
    }
    _exit(fault);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  if (WEXITSTATUS(status) == kNoSmallDisk) GTEST_SKIP() << "a small disk can only be mounted by root";
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

}  // namespace
}  // namespace legopt::db
