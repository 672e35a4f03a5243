// Policy: temporary files are where TMPDIR names a folder. If they cannot be there, the error names the variable, its
// value and what to do.
#include "legopt/files/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <cstdlib>
#include <functional>
#include <optional>
#include <string>

#include "legopt/files/written_file.h"
#include "tests/temporary_folder.h"

namespace legopt::files {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class TemporaryFolderTest : public ::testing::Test {
 protected:
  TemporaryFolderTest() {
    if (const char* const value = std::getenv("TMPDIR"); value != nullptr) usual_ = value;
  }
  ~TemporaryFolderTest() override {
    if (usual_) {
      ::setenv("TMPDIR", usual_->c_str(), 1);
    } else {
      ::unsetenv("TMPDIR");
    }
  }

  static FileError ErrorWith(const std::string& tmpdir, const std::function<void()>& call) {
    ::setenv("TMPDIR", tmpdir.c_str(), 1);
    try {
      call();
    } catch (const FileError& error) {
      return error;
    }
    ADD_FAILURE() << "no error";
    return {"", "", 0};
  }

  const test::TemporaryFolder folder_;
  std::optional<std::string> usual_;
};

TEST_F(TemporaryFolderTest, FilesAndFoldersAreWhereTmpdirSays) {
  ::setenv("TMPDIR", folder_.path().c_str(), 1);
  EXPECT_EQ(FolderForTemporaryFiles(), folder_.path());
  const fs::path a = CreateTemporaryFolder("a-"), b = CreateTemporaryFolder("a-"), file = CreateTemporaryFile("b-");
  EXPECT_NE(a, b);
  EXPECT_EQ(a.parent_path(), folder_.path());
  EXPECT_TRUE(fs::is_directory(a));
  EXPECT_EQ(file.parent_path(), folder_.path());
  EXPECT_TRUE(fs::is_regular_file(file));
}

TEST_F(TemporaryFolderTest, AMissingFolderIsNamedWithItsVariable) {
  const std::string missing = folder_ / "missing";
  for (const auto& call : {std::function<void()>([] { FolderForTemporaryFiles(); }),
                           std::function<void()>([] { CreateTemporaryFolder("a-"); }),
                           std::function<void()>([] { CreateTemporaryFile("a-"); })}) {
    const FileError error = ErrorWith(missing, call);
    EXPECT_EQ(error.error(), ENOENT);
    EXPECT_THAT(error.what(), AllOf(StartsWith(missing + ": "), HasSubstr("(TMPDIR)"), HasSubstr("set TMPDIR to")));
  }
}

TEST_F(TemporaryFolderTest, AFolderThatCannotBeWrittenIsNamedWithTheVariable) {
  for (const auto& call : {std::function<void()>([] { CreateTemporaryFolder("a-"); }),
                           std::function<void()>([] { CreateTemporaryFile("a-"); })}) {
    const FileError error = ErrorWith("/proc", call);  // root cannot create files there either
    EXPECT_THAT(error.what(), AllOf(StartsWith("/proc"), HasSubstr("set TMPDIR to another folder")));
  }
}

}  // namespace
}  // namespace legopt::files
