// A database is identified by its file, not its name: there is one writer for all names, and the writer detects that
// the file is no longer at its path. Afterwards, everything acknowledged is in one complete file.
#include "db/database_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "db/audit.h"
#include "db/connection.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class OneWriterPerFile : public testing::Test {
 protected:
  void ExpectLocked(const fs::path& path) {
    try {
      OpenSqliteStore(path);
      ADD_FAILURE() << "opened " << path;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kLocked) << error.what();
      EXPECT_THAT(error.what(), HasSubstr("process " + std::to_string(getpid()) + " on "));
    }
  }

  TemporaryFolder folder_;
  fs::path path_ = folder_ / "results.sqlite";
};

TEST_F(OneWriterPerFile, BehindASymbolicLink) {
  const auto first = OpenSqliteStore(path_);
  fs::create_symlink("results.sqlite", folder_ / "link.sqlite");
  ExpectLocked(folder_ / "link.sqlite");
  fs::create_directory_symlink(folder_.path(), folder_ / "folder");
  ExpectLocked(folder_ / "folder/results.sqlite");
  ExpectLocked(folder_ / "folder/./results.sqlite");
}

TEST_F(OneWriterPerFile, WhoCameThroughTheLink) {
  fs::create_symlink("results.sqlite", folder_ / "link.sqlite");
  const auto first = OpenSqliteStore(folder_ / "link.sqlite");  // creates the file that the link names
  EXPECT_TRUE(fs::exists(path_));
  ExpectLocked(path_);
}

TEST_F(OneWriterPerFile, BehindAHardLink) {
  auto first = OpenSqliteStore(path_);
  fs::create_hard_link(path_, folder_ / "hard.sqlite");
  ExpectLocked(folder_ / "hard.sqlite");
  EXPECT_FALSE(fs::exists(folder_ / "hard.sqlite.lock")) << "nothing is left behind";
  first.reset();
  OpenSqliteStore(folder_ / "hard.sqlite");
}

TEST_F(OneWriterPerFile, ARefusedSecondServerDisturbsNothing) {
  const auto first = OpenSqliteStore(path_);
  fs::create_hard_link(path_, folder_ / "hard.sqlite");
  ExpectLocked(folder_ / "hard.sqlite");
  first->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}});
  EXPECT_EQ(first->LoadOpenState().experiments.size(), 1U);
}

TEST(NewDatabaseFile, AFolderWithoutPermissionIsTheCause) {
  if (geteuid() != 0) GTEST_SKIP() << "needs two users";
  const TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::owner_all | fs::perms::others_read | fs::perms::others_exec);
  constexpr uid_t kOther = 54321;
  ASSERT_EQ(::seteuid(kOther), 0);
  try {
    OpenSqliteStore(folder / "results.sqlite");
    ADD_FAILURE() << "opened";
  } catch (const StoreError& error) {
    EXPECT_EQ(error.code(), StoreErrorCode::kUnwritable);
    EXPECT_THAT(error.what(), HasSubstr("Permission denied; check the permissions"));
  }
  EXPECT_EQ(::seteuid(0), 0);
}

class DisplacedFile : public testing::Test {
 protected:
  void SetUp() override {
    store_ = OpenSqliteStore(path_);
    store_->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}});
    EXPECT_NO_THROW(store_->CheckPlace());
  }

  std::string Complaint() {
    try {
      store_->CheckPlace();
      ADD_FAILURE() << "nothing was noticed";
      return {};
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kDisplaced) << error.what();
      EXPECT_TRUE(error.transient());
      EXPECT_THAT(error.what(), HasSubstr(path_.string() + ": "));
      return error.what();
    }
  }

  void ExpectNothingIsTaken() {
    try {
      store_->Apply(std::vector<StoreOp>{LeaseJob{1, 1, 71, 1, 1}});
      ADD_FAILURE() << "a commit into nowhere was acknowledged";
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kDisplaced) << error.what();
    }
    EXPECT_FALSE(store_->FindAttempt(1, 1));
  }

  // Expects that this file alone, without side files, is sound and has everything acknowledged, as after a kill.
  void ExpectWhole(const fs::path& file) {
    const fs::path copy = folder_ / "copy.sqlite";
    fs::copy_file(file, copy, fs::copy_options::overwrite_existing);
    for (const AuditDiagnostic& defect : Audit(copy)) ADD_FAILURE() << defect.rule << ": " << defect.detail;
    Connection connection(copy, Connection::Mode::kReadOnly);
    EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM jobs"), 4);
  }

  std::vector<fs::path> Rescued() {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(path_.parent_path())) {
      if (entry.path().string().find(".rescued-") != std::string::npos) files.push_back(entry.path());
    }
    return files;
  }

  TemporaryFolder folder_;
  fs::path path_ = fs::canonical(folder_.path()) / "results.sqlite";
  std::unique_ptr<Store> store_;
};

TEST_F(DisplacedFile, MovedIsWholeAndServesAgainWhenItIsBack) {
  const fs::path moved = path_.parent_path() / "moved.sqlite";
  fs::rename(path_, moved);
  EXPECT_THAT(Complaint(), HasSubstr("moved to " + moved.string()));
  ExpectWhole(moved);
  ExpectNothingIsTaken();
  EXPECT_TRUE(Rescued().empty()) << "it has a name";
  fs::rename(moved, path_);
  EXPECT_NO_THROW(store_->CheckPlace());
  store_->Apply(std::vector<StoreOp>{LeaseJob{1, 1, 71, 1, 1}});
  store_.reset();
  EXPECT_EQ(OpenSqliteStore(path_)->FindAttempt(1, 1)->token, 71);
}

TEST_F(DisplacedFile, ACommitNoticesByItself) {
  fs::rename(path_, folder_ / "moved.sqlite");
  ExpectNothingIsTaken();
  ExpectWhole(folder_ / "moved.sqlite");
}

TEST_F(DisplacedFile, MovedWithItsFolder) {
  store_.reset();
  fs::create_directory(folder_ / "old");
  path_ = fs::canonical(folder_ / "old") / "results.sqlite";
  SetUp();
  fs::rename(folder_ / "old", folder_ / "new");
  EXPECT_THAT(Complaint(), HasSubstr("/new/results.sqlite"));
  ExpectWhole(folder_ / "new/results.sqlite");
  fs::rename(folder_ / "new", folder_ / "old");
  EXPECT_NO_THROW(store_->CheckPlace());
}

TEST_F(DisplacedFile, RemovedIsCopiedBesideItsOldNameOnce) {
  fs::remove(path_);
  const std::string complaint = Complaint();
  EXPECT_THAT(complaint, HasSubstr("was removed"));
  ASSERT_EQ(Rescued().size(), 1U);
  EXPECT_THAT(complaint, HasSubstr(Rescued()[0].string()));
  ExpectWhole(Rescued()[0]);
  ExpectNothingIsTaken();
  EXPECT_EQ(Complaint(), complaint);
  EXPECT_EQ(Rescued().size(), 1U);
  store_.reset();
  fs::rename(Rescued()[0], path_);
  store_ = OpenSqliteStore(path_);
  EXPECT_NO_THROW(store_->CheckPlace());
  EXPECT_EQ(store_->LoadOpenState().open.size(), 1U);
}

TEST_F(DisplacedFile, ReplacedIsNoticedAndTheOtherFileLeftAlone) {
  const std::string other(5000, 'x');
  std::ofstream(folder_ / "other") << other;
  fs::rename(folder_ / "other", path_);
  EXPECT_THAT(Complaint(), HasSubstr("replaced"));
  ASSERT_EQ(Rescued().size(), 1U);
  ExpectWhole(Rescued()[0]);
  ExpectNothingIsTaken();
  std::ifstream file(path_);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), other);
}

TEST_F(DisplacedFile, WithoutAFolderForTheCopyTheOpenFileIsNamed) {
  store_.reset();
  fs::create_directory(folder_ / "gone");
  path_ = fs::canonical(folder_ / "gone") / "results.sqlite";
  SetUp();
  fs::remove_all(folder_ / "gone");
  const std::string complaint = Complaint();
  const auto begin = complaint.find("/proc/" + std::to_string(getpid()) + "/fd/");
  ASSERT_NE(begin, std::string::npos) << complaint;
  ExpectWhole(complaint.substr(begin, complaint.find(' ', begin) - begin));
}

TEST_F(DisplacedFile, AHardLinkThatIsLeftIsWhole) {
  fs::create_hard_link(path_, folder_ / "hard.sqlite");
  fs::remove(path_);
  EXPECT_THAT(Complaint(), HasSubstr("hard link"));
  ExpectWhole(folder_ / "hard.sqlite");
}

TEST_F(DisplacedFile, ARemovedLogIsWrittenIntoTheDatabase) {
  for (const char* side_file : {"-wal", "-shm"}) {
    fs::remove(path_.string() + side_file);
    EXPECT_THAT(Complaint(), HasSubstr("side file")) << side_file;
    ExpectWhole(path_);
    ExpectNothingIsTaken();
    store_.reset();
    store_ = OpenSqliteStore(path_);
    EXPECT_NO_THROW(store_->CheckPlace()) << side_file;
  }
}

// A reader that opened the file before keeps its snapshot. It stops neither the recovery nor the server.
TEST_F(DisplacedFile, ReaderOnlyDelaysTheRecovery) {
  Connection reader(path_, Connection::Mode::kReadOnly);
  reader.Execute("BEGIN");
  reader.QueryInt("SELECT count(*) FROM jobs");
  store_->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(2, 5, 3)}});
  fs::rename(path_, folder_ / "moved.sqlite");
  EXPECT_THAT(Complaint(), HasSubstr("do not stop the server yet"));
  reader.Execute("COMMIT");
  EXPECT_THAT(Complaint(), HasSubstr("move it back"));
  fs::copy_file(folder_ / "moved.sqlite", folder_ / "copy.sqlite");
  Connection copy(folder_ / "copy.sqlite", Connection::Mode::kReadOnly);
  EXPECT_EQ(copy.QueryInt("SELECT count(*) FROM experiments"), 2);
}

}  // namespace
}  // namespace legopt::db
