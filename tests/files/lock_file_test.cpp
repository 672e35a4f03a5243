// Policy: only a file that can be a lock file of this program is opened as one, and no other file is changed.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include "legopt/files/name_lock.h"
#include "legopt/files/written_file.h"
#include "tests/temporary_folder.h"

namespace legopt::files {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class LockFileTest : public ::testing::Test {
 protected:
  std::string Fault() {
    try {
      ::close(OpenLockFile(lock_));
    } catch (const FileError& fault) {
      return fault.what();
    }
    return {};
  }

  void Put(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

  std::string Content(const fs::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

  test::TemporaryFolder folder_;
  fs::path lock_ = folder_ / "r.sqlite.lock";
  fs::path precious_ = folder_ / "precious";
};

TEST_F(LockFileTest, IsCreatedAndOpenedAgain) {
  EXPECT_EQ(Fault(), "");
  EXPECT_EQ(Fault(), "");
  Put(lock_, "process 12 on host\n");
  EXPECT_EQ(Fault(), "");
}

TEST_F(LockFileTest, ASymbolicLinkIsLeftAlone) {
  Put(precious_, "secrets");
  fs::create_symlink(precious_, lock_);
  EXPECT_THAT(Fault(), HasSubstr("symbolic link"));
  EXPECT_EQ(Content(precious_), "secrets");
  fs::remove(precious_);
  EXPECT_THAT(Fault(), HasSubstr("symbolic link"));
  EXPECT_FALSE(fs::exists(precious_));
}

TEST_F(LockFileTest, AHardLinkIsLeftAlone) {
  Put(precious_, "process of mine");
  fs::create_hard_link(precious_, lock_);
  EXPECT_THAT(Fault(), HasSubstr("hard links"));
}

TEST_F(LockFileTest, AnotherFileIsLeftAlone) {
  Put(lock_, "the only copy of my thesis");
  EXPECT_THAT(Fault(), HasSubstr("no lock file"));
  EXPECT_EQ(Content(lock_), "the only copy of my thesis");
}

TEST_F(LockFileTest, AFolderIsNone) {
  fs::create_directory(lock_);
  EXPECT_NE(Fault(), "");
}

}  // namespace
}  // namespace legopt::files
