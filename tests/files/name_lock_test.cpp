// Policy: one holder at a time; what happens to holder or file never locks others out for good.
#include "legopt/files/name_lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <optional>

#include "tests/temporary_folder.h"

namespace legopt::files {
namespace {

namespace fs = std::filesystem;

class NameLockTest : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
  fs::path name_ = folder_ / "out.partial";
  fs::path file_ = folder_ / "out.partial.lock";
};

TEST_F(NameLockTest, HasOneHolder) {
  std::optional<NameLock> first(name_);
  EXPECT_EQ(first->holder(), "");
  EXPECT_THAT(NameLock(name_).holder(), testing::HasSubstr("process " + std::to_string(getpid()) + " on "));
  EXPECT_TRUE(fs::exists(file_));
  first.reset();
  EXPECT_FALSE(fs::exists(file_));
  EXPECT_EQ(NameLock(name_).holder(), "");
}

TEST_F(NameLockTest, EndsWithItsProcess) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const NameLock lock(name_);
    raise(SIGKILL);
  }
  waitpid(child, nullptr, 0);
  EXPECT_TRUE(fs::exists(file_));
  EXPECT_EQ(NameLock(name_).holder(), "");
}

TEST_F(NameLockTest, AFileOfOthersIsLeftAlone) {
  std::ofstream(file_) << "my notes";
  EXPECT_EQ(NameLock(name_).holder(), "");
  EXPECT_EQ(fs::file_size(file_), 8U);
  EXPECT_EQ(NameLock("/no/such/folder/out").holder(), "");
}

}  // namespace
}  // namespace legopt::files
