// A log is only read with the file it was written for, and a backup replaces a database completely.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "db/audit.h"
#include "db/backup.h"
#include "db/connection.h"
#include "db/file_state.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "tests/db/fixtures.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class RestoreTest : public testing::Test {
 protected:
  // Kills a server after it has created `experiments` experiments; its log remains.
  static void KillAServerOn(const fs::path& path, int first, int experiments) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const auto store = OpenSqliteStore(path);
      for (int i = first; i < first + experiments; ++i) {
        store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(i, 4 * (i - 1) + 1, 2 * (i - 1) + 1)}});
      }
      raise(SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_TRUE(fs::exists(path.string() + "-wal"));
  }

  static std::int64_t Experiments(const fs::path& path) {
    return std::get<std::int64_t>(ReadOnlyDatabase(path).Query("SELECT count(*) FROM experiments").rows.at(0).at(0));
  }

  void ExpectRefusedBesideTheLog() {
    const auto expect = [&](const std::function<void()>& open) {
      try {
        open();
        ADD_FAILURE() << "opened";
      } catch (const StoreError& error) {
        EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << error.what();
        EXPECT_THAT(error.what(), HasSubstr("was written for another file"));
        EXPECT_THAT(error.what(), HasSubstr("legopt service restore BACKUP --db FILE"));
      }
    };
    for (int again = 0; again < 2; ++again) {
      expect([&] { ReadOnlyDatabase{path_}; });
      expect([&] { BackUp(path_, folder_ / "copy.sqlite"); });
      expect([&] { Audit(path_); });
      expect([&] { OpenSqliteStore(path_); });
    }
  }

  TemporaryFolder folder_;
  fs::path path_ = fs::canonical(folder_.path()) / "results.sqlite";
  fs::path backup_ = path_.parent_path() / "backup.sqlite";
};

TEST_F(RestoreTest, ABackupHasASessionOfItsOwn) {
  { OpenSqliteStore(path_); }
  BackUp(path_, backup_);
  Connection one(path_, Connection::Mode::kReadOnly), other(backup_, Connection::Mode::kReadOnly);
  ASSERT_TRUE(SessionOf(one) && SessionOf(other));
  EXPECT_NE(SessionOf(one), SessionOf(other));
}

// In a container, a program often has the process id of the one that was killed.
TEST_F(RestoreTest, WhatAnEarlierProcessOfThisIdHasLeftStaysAndBlocksNothing) {
  { OpenSqliteStore(path_); }
  const std::string pid = std::to_string(getpid());
  const std::string left[] = {backup_.string() + ".partial-" + pid, path_.string() + ".restored-" + pid};
  for (const std::string& file : left) std::ofstream(file) << "left";
  BackUp(path_, backup_);
  Restore(backup_, path_);
  EXPECT_EQ(Experiments(path_), 0);
  for (const std::string& file : left) {
    EXPECT_EQ(fs::file_size(file), 4U);
    fs::remove(file);
  }
  for (const auto& entry : fs::directory_iterator(path_.parent_path())) {
    const std::string name = entry.path().filename();
    EXPECT_EQ(name.find(".partial-"), std::string::npos) << name;
    EXPECT_EQ(name.find(".restored-"), std::string::npos) << name;
  }
}

TEST_F(RestoreTest, AFileAndItsOwnLogGoOnAfterAKill) {
  KillAServerOn(path_, 1, 2);
  EXPECT_EQ(Experiments(path_), 2);
  KillAServerOn(path_, 3, 1);
  EXPECT_EQ(Experiments(path_), 3);
  { OpenSqliteStore(path_); }
  EXPECT_EQ(Experiments(path_), 3);
  EXPECT_FALSE(fs::exists(path_.string() + ".lock"));
}

TEST_F(RestoreTest, AFileAndItsOwnLogCanBeMovedTogether) {
  KillAServerOn(path_, 1, 2);
  const fs::path moved = folder_ / "moved.sqlite";
  fs::rename(path_, moved);
  fs::rename(path_.string() + "-wal", moved.string() + "-wal");
  EXPECT_EQ(Experiments(moved), 2);
}

TEST_F(RestoreTest, ABackupOfTheSameHistoryIsRefusedBesideTheOldLog) {
  KillAServerOn(path_, 1, 1);
  BackUp(path_, backup_);
  KillAServerOn(path_, 2, 1);
  fs::copy_file(backup_, path_, fs::copy_options::overwrite_existing);
  ExpectRefusedBesideTheLog();
}

TEST_F(RestoreTest, AFileOfAnotherHistoryIsRefusedBesideTheOldLog) {
  { OpenSqliteStore(backup_); }
  KillAServerOn(path_, 1, 2);
  fs::copy_file(backup_, path_, fs::copy_options::overwrite_existing);
  ExpectRefusedBesideTheLog();
}

// A plain copy of the file, made before the last server started.
TEST_F(RestoreTest, AnEarlierStateOfTheFileIsRefusedBesideTheLog) {
  { OpenSqliteStore(path_); }
  fs::copy_file(path_, backup_);
  KillAServerOn(path_, 1, 2);
  fs::copy_file(backup_, path_, fs::copy_options::overwrite_existing);
  ExpectRefusedBesideTheLog();
}

TEST_F(RestoreTest, AFileOfAnOlderReleaseIsRefusedBesideTheLog) {
  KillAServerOn(path_, 1, 2);
  fs::remove(path_);
  fs::rename(path_.string() + "-wal", folder_ / "log");  // keeps the log away while the older file is created
  MakeReleased(9, path_);
  fs::rename(folder_ / "log", path_.string() + "-wal");
  ExpectRefusedBesideTheLog();
}

TEST_F(RestoreTest, ALogAloneTellsWhoseItIs) {
  KillAServerOn(path_, 1, 1);
  BackUp(path_, backup_);
  KillAServerOn(path_, 2, 1);
  fs::copy_file(backup_, path_, fs::copy_options::overwrite_existing);
  fs::remove(path_.string() + ".lock");
  ExpectRefusedBesideTheLog();
}

TEST_F(RestoreTest, RestoringMovesFileAndLogAwayAndKeepsThemTogether) {
  KillAServerOn(path_, 1, 1);
  BackUp(path_, backup_);
  KillAServerOn(path_, 2, 2);
  const RestoreReport report = Restore(backup_, path_);
  EXPECT_EQ(report.content.experiments, 1);
  EXPECT_EQ(Experiments(path_), 1);
  EXPECT_EQ(Experiments(report.moved_away), 3) << "its log went with it";
  EXPECT_EQ(Experiments(backup_), 1) << "the backup stays";
  EXPECT_FALSE(fs::exists(path_.string() + ".lock"));
  EXPECT_FALSE(fs::exists(path_.string() + "-wal"));
  for (const AuditDiagnostic& defect : Audit(path_)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
  EXPECT_EQ(OpenSqliteStore(path_)->LoadOpenState().experiments.size(), 1U);
}

TEST_F(RestoreTest, RestoringMendsACopyOverALog) {
  KillAServerOn(path_, 1, 1);
  BackUp(path_, backup_);
  KillAServerOn(path_, 2, 1);
  fs::copy_file(backup_, path_, fs::copy_options::overwrite_existing);
  Restore(backup_, path_);
  EXPECT_EQ(Experiments(path_), 1);
}

TEST_F(RestoreTest, RestoresWhereThereIsNoFileAndOverADamagedOne) {
  { OpenSqliteStore(backup_); }
  EXPECT_TRUE(Restore(backup_, path_).moved_away.empty());
  EXPECT_EQ(Experiments(path_), 0);
  std::ofstream(path_, std::ios::trunc) << "no database";
  const fs::path former = Restore(backup_, path_).moved_away;
  EXPECT_EQ(fs::file_size(former), std::string("no database").size());
  EXPECT_EQ(Experiments(path_), 0);
}

TEST_F(RestoreTest, NothingIsTouchedUnderAServer) {
  { OpenSqliteStore(backup_); }
  const auto store = OpenSqliteStore(path_);
  store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}});
  EXPECT_THROW(Restore(backup_, path_), StoreError);
  EXPECT_EQ(Experiments(path_), 1);
  for (const auto& entry : fs::directory_iterator(path_.parent_path())) {
    EXPECT_EQ(entry.path().string().find(".restored-"), std::string::npos) << entry.path();
    EXPECT_EQ(entry.path().string().find(".replaced-"), std::string::npos) << entry.path();
  }
}

TEST_F(RestoreTest, ADamagedBackupReplacesNothing) {
  { OpenSqliteStore(path_); }
  std::ofstream(backup_) << std::string(5000, 'x');
  EXPECT_THROW(Restore(backup_, path_), StoreError);
  EXPECT_THROW(Restore(path_, path_), StoreError);
  EXPECT_EQ(Experiments(path_), 0);
}

}  // namespace
}  // namespace legopt::db
