// A backup of a database in use equals one commit of its history, is sound, is complete as soon as it has its name,
// and never blocks other users. Acceptance figure 20.
#include "db/backup.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <functional>
#include <iterator>
#include <thread>

#include "db/audit.h"
#include "db/connection.h"
#include "db/sqlite_store.h"
#include "tests/db/faulty_vfs.h"
#include "tests/db/fixtures.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

std::string Bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Backup : public testing::Test {
 protected:
  void ExpectRefused(const std::filesystem::path& source, const std::filesystem::path& target, StoreErrorCode code) {
    try {
      BackUp(source, target);
      ADD_FAILURE() << "made " << target;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), code) << error.what();
    }
  }
  std::size_t FilesInFolder() {
    const auto folder = path_.parent_path();
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "results.sqlite";
  std::filesystem::path copy_ = folder_ / "copy.sqlite";
};

// Jobs are leased and done in order, one commit each: a prefix of this history has the results of jobs 1 .. n.
TEST_F(Backup, TwentyUnderLoadAreEachAPrefixOfHistory) {
  constexpr int kPairs = 20'000;
  constexpr int kBackups = 20;
  std::atomic<std::int64_t> acknowledged = 0;
  std::atomic<bool> stop = false;
  std::thread server([&] {
    const auto store = OpenSqliteStore(path_);
    store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1, kPairs)}, PutWorker{SampleWorker(1)}});
    acknowledged = 1;  // there is something to copy
    for (std::int64_t job = 1; job <= kPairs && !stop; ++job) {
      store->Apply(std::vector<StoreOp>{LeaseJob{job, 1, job, 1, 1}, AcceptResult{job, 1, SampleResult(), "", "", 2}});
      acknowledged = job;
    }
  });
  while (acknowledged == 0) std::this_thread::yield();
  for (int i = 0; i < kBackups; ++i) {
    const auto target = folder_ / (std::to_string(i) + ".sqlite");
    const std::int64_t before = acknowledged;
    const BackupReport report = BackUp(path_, target);
    const std::int64_t after = acknowledged + 1;  // one may be on disk and not yet acknowledged
    for (const AuditDiagnostic& defect : Audit(target)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
    Connection connection(target, Connection::Mode::kReadOnly);
    const std::int64_t done = connection.QueryInt("SELECT count(*) FROM results");
    EXPECT_EQ(connection.QueryInt("SELECT coalesce(max(job_id), 0) FROM results"), done);
    EXPECT_EQ(report.results, done);
    EXPECT_GE(done, before > 1 ? before : 0) << "what was acknowledged before is in it";
    EXPECT_LE(done, after);
    std::filesystem::remove(target);
  }
  stop = true;
  server.join();
}

TEST_F(Backup, ReadsTheLogOfADeadServerAndChangesNothing) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto store = OpenSqliteStore(path_);
    store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}});
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  const std::string log = path_.string() + "-wal";
  const std::string before = Bytes(path_), log_before = Bytes(log);
  ASSERT_FALSE(log_before.empty());
  EXPECT_EQ(BackUp(path_, copy_).jobs, 4);
  EXPECT_EQ(Bytes(path_), before) << "the server alone writes and checkpoints";
  EXPECT_EQ(Bytes(log), log_before);
}

TEST_F(Backup, IsRestoredByOpeningIt) {
  MakeReleased(9, path_);
  BackUp(path_, copy_);
  EXPECT_FALSE(std::filesystem::exists(copy_.string() + "-wal")) << "one file";
  const auto store = OpenSqliteStore(copy_);
  EXPECT_EQ(store->LoadOpenState().open.size(), 1U);
}

TEST_F(Backup, NeverOverwrites) {
  { OpenSqliteStore(path_); }
  std::ofstream(copy_) << "precious";
  ExpectRefused(path_, copy_, StoreErrorCode::kUnwritable);
  EXPECT_EQ(Bytes(copy_), "precious");
  ExpectRefused(path_, path_, StoreErrorCode::kUnwritable);
  std::filesystem::create_symlink(folder_ / "nowhere", folder_ / "link");
  ExpectRefused(path_, folder_ / "link", StoreErrorCode::kUnwritable);
  std::filesystem::create_directory(folder_ / "folder");
  ExpectRefused(path_, folder_ / "folder", StoreErrorCode::kUnwritable);
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "folder"));
}

TEST_F(Backup, WrongSourcesAreNamed) {
  ExpectRefused(folder_ / "missing", copy_, StoreErrorCode::kNotFound);
  std::ofstream(folder_ / "text") << std::string(5000, 'x');
  ExpectRefused(folder_ / "text", copy_, StoreErrorCode::kNotLegopt);
  std::ofstream(folder_ / "empty") << "";
  ExpectRefused(folder_ / "empty", copy_, StoreErrorCode::kNotLegopt);
  { OpenSqliteStore(path_); }
  ExpectRefused(path_, folder_ / "no" / "copy", StoreErrorCode::kUnwritable);
}

TEST_F(Backup, ADamagedDatabaseMakesNoCopy) {
  MakeReleased(9, path_);
  { OpenSqliteStore(path_); }
  {
    std::fstream file(path_, std::ios::binary | std::ios::in | std::ios::out);
    file.seekp(5 * 4096);
    file << std::string(4096, '\xA5');
  }
  ExpectRefused(path_, copy_, StoreErrorCode::kCorrupt);
  EXPECT_FALSE(std::filesystem::exists(copy_));
}

// The disk of the copy is full or fails at any call: there is no copy, and nothing is left behind.
TEST_F(Backup, AFullDiskLeavesNothingBehind) {
  MakeReleased(9, path_);
  { OpenSqliteStore(path_); }
  const std::size_t files = FilesInFolder();
  const std::string log = path_.string() + "-wal";
  for (const auto fault : {FaultyVfs::Fault::kFull, FaultyVfs::Fault::kIoError}) {
    FaultyVfs vfs;
    for (std::int64_t call = 1;; ++call) {
      constexpr std::int64_t kForEver = 1'000'000;
      vfs.Arm(fault, call, kForEver);
      try {
        BackUp(path_, copy_);
        vfs.Disarm();
        EXPECT_TRUE(Audit(copy_).empty());
        std::filesystem::remove(copy_);
        EXPECT_GT(call, 10);
        break;
      } catch (const StoreError& error) {
        vfs.Disarm();
        EXPECT_FALSE(std::filesystem::exists(copy_)) << call << ": " << error.what();
        // A disk that fails for ever may keep the empty side files of the database.
        EXPECT_TRUE(!std::filesystem::exists(log) || std::filesystem::is_empty(log)) << call;
        for (const std::string& side_file : {log, path_.string() + "-shm"}) std::filesystem::remove(side_file);
        EXPECT_EQ(FilesInFolder(), files) << call;
        if (HasFailure()) return;
      }
    }
  }
}

}  // namespace
}  // namespace legopt::db
