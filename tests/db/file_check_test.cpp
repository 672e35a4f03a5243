// Policy: damage that SQLite misreads is refused with its name. Files after a crash or a loss of power are accepted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <functional>

#include "db/file_state.h"
#include "db/read_only_database.h"
#include "db/sqlite_store.h"
#include "db/store_error.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr std::size_t kLogHeader = 32, kFrame = 24 + 4096;

class FileCheck : public testing::Test {
 protected:
  // A server that is killed after some commits; its log stays.
  void SetUp() override {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const auto store = OpenSqliteStore(path_);
      for (int i = 1; i <= 3; ++i) {
        store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(i, 4 * (i - 1) + 1, 2 * (i - 1) + 1)}});
      }
      raise(SIGKILL);
    }
    int status = 0;
    waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    ASSERT_GT(fs::file_size(log_), kLogHeader + 4 * kFrame);
  }

  static std::string Bytes(const fs::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  static void Change(const fs::path& file, const std::function<void(std::string&)>& change) {
    std::string bytes = Bytes(file);
    change(bytes);
    std::ofstream(file, std::ios::binary) << bytes;
  }
  // Behind the last frame of this log; frames of an earlier one may follow, with other salts.
  static std::size_t EndOfFrames(const std::string& log) {
    constexpr std::size_t kSaltOfLog = 16, kSaltOfFrame = 8, kSaltBytes = 8;
    std::size_t end = kLogHeader;
    while (end + kFrame <= log.size() &&
           log.compare(end + kSaltOfFrame, kSaltBytes, log, kSaltOfLog, kSaltBytes) == 0) {
      end += kFrame;
    }
    return end;
  }
  void ExpectDamage(const std::string& words) {
    const auto expect = [&](const std::function<void()>& open) {
      try {
        open();
        ADD_FAILURE() << "opened";
      } catch (const StoreError& error) {
        EXPECT_EQ(error.code(), StoreErrorCode::kCorrupt) << error.what();
        EXPECT_THAT(error.what(), HasSubstr(words));
        EXPECT_THAT(error.what(), HasSubstr("legopt service restore BACKUP --db FILE"));
      }
    };
    expect([&] { RequireSoundFiles(path_); });
    expect([&] { ReadOnlyDatabase database(path_); });
    expect([&] { OpenSqliteStore(path_); });
  }
  std::int64_t Experiments() const {
    return std::get<std::int64_t>(ReadOnlyDatabase(path_).Query("SELECT count(*) FROM experiments").rows.at(0).at(0));
  }

  test::TemporaryFolder folder_;
  fs::path path_ = folder_ / "results.sqlite", log_ = path_.string() + "-wal";
};

TEST_F(FileCheck, ALogOfAKilledServerIsSound) {
  RequireSoundFiles(path_);
  EXPECT_EQ(Experiments(), 3);
}

TEST_F(FileCheck, ADamagedFrameBeforeLaterCommitsIsRefused) {
  const std::string sound = Bytes(log_);
  const auto with = [&](const std::function<void(std::string&)>& change) {
    Change(log_, [&](std::string& bytes) { bytes = sound; });
    Change(log_, change);
    fs::remove(path_.string() + "-shm");  // SQLite reads the log again
  };
  with([](std::string& bytes) { bytes[kLogHeader + 24 + 500] ^= 1; });  // a page
  ExpectDamage("its frame 1 is damaged, and commits follow");
  with([](std::string& bytes) { bytes[kLogHeader + kFrame + 17] ^= 1; });  // a checksum
  ExpectDamage("its frame 2 is damaged");
  with([](std::string& bytes) { bytes.replace(kLogHeader, 2 * kFrame, 2 * kFrame, '\0'); });
  ExpectDamage("its frame 1 is damaged");
  with([](std::string& bytes) { bytes.replace(0, kLogHeader, kLogHeader, '\0'); });
  ExpectDamage("its header is damaged");
  with([](std::string& bytes) { bytes[18] ^= 1; });
  ExpectDamage("its header is damaged");
  with([](std::string&) {});
  EXPECT_EQ(Experiments(), 3);
}

TEST_F(FileCheck, ATornLastCommitIsNotDamage) {
  const std::size_t end = EndOfFrames(Bytes(log_));
  Change(log_, [&](std::string& bytes) { bytes[end - 100] ^= 1; });
  RequireSoundFiles(path_);
  fs::resize_file(log_, end - 100);
  RequireSoundFiles(path_);
  fs::remove(path_.string() + "-shm");
  EXPECT_EQ(Experiments(), 2);
  fs::resize_file(log_, kLogHeader);
  RequireSoundFiles(path_);
  fs::resize_file(log_, 10);
  RequireSoundFiles(path_);
}

TEST_F(FileCheck, FramesOfAnEarlierRoundAreNotDamage) {
  // A log is begun anew over the frames of the round before, which have other salts.
  OpenSqliteStore(path_);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto store = OpenSqliteStore(path_);
    for (int i = 4; i <= 12; ++i) {
      store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(i, 4 * (i - 1) + 1, 2 * (i - 1) + 1)}});
      RequireSoundFiles(path_);
    }
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  RequireSoundFiles(path_);
  EXPECT_EQ(Experiments(), 12);
}

TEST_F(FileCheck, ACutFileAndAnUnknownFormatAreRefused) {
  OpenSqliteStore(path_);  // moves the log into the file
  const std::string sound = Bytes(path_);
  Change(path_, [](std::string& bytes) { bytes.resize(bytes.size() - 100); });
  ExpectDamage("its last page is cut off");
  for (const std::size_t at : {18, 19}) {
    Change(path_, [&](std::string& bytes) {
      bytes = sound;
      bytes[at] = 9;
    });
    ExpectDamage("its header names the unknown format version 9");
  }
}

TEST_F(FileCheck, OtherFilesAreLeftToSqlite) {
  RequireSoundFiles(folder_ / "missing");
  RequireSoundFiles(folder_.path());
  std::ofstream(folder_ / "text") << "SQLite format 3";
  RequireSoundFiles(folder_ / "text");
}

}  // namespace
}  // namespace legopt::db
