// Policy: files appear complete under their name or not at all, planted links are never written through, and a file
// that could not be written leaves nothing behind.

#include "legopt/files/written_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <fstream>
#include <set>
#include <string>

#include "tests/temporary_folder.h"

namespace legopt::files {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Content(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

void Put(const fs::path& file, const std::string& text) { std::ofstream(file) << text; }

std::set<std::string> NamesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

/// A soft limit on file sizes, whose signal is ignored as in all programs.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

class WrittenFileTest : public ::testing::Test {
 protected:
  template <class Call>
  std::string FaultOf(const Call& call, int error) {
    try {
      call();
    } catch (const FileError& fault) {
      EXPECT_EQ(fault.error(), error);
      return fault.what();
    }
    return "no fault";
  }

  test::TemporaryFolder folder_;
  fs::path file_ = folder_ / "result.json";
};

TEST_F(WrittenFileTest, AFileIsReplacedAndNothingElseIsLeft) {
  ReplaceFile(file_, "old");
  ReplaceFile(file_, "new");
  EXPECT_EQ(Content(file_), "new");
  EXPECT_THAT(NamesIn(folder_.path()), ElementsAre("result.json"));
}

TEST_F(WrittenFileTest, APlantedTemporaryFileIsNotWrittenThrough) {
  Put(folder_ / "precious", "secrets");
  fs::create_symlink(folder_ / "precious", folder_ / "result.json.new");
  ReplaceFile(file_, "text");
  EXPECT_EQ(Content(folder_ / "precious"), "secrets");
  EXPECT_EQ(Content(file_), "text");
}

TEST_F(WrittenFileTest, LinksOfTheUserAreFollowedAndStay) {
  fs::create_directory(folder_ / "elsewhere");
  fs::create_symlink("elsewhere/target.json", file_);
  ReplaceFile(file_, "text");
  EXPECT_TRUE(fs::is_symlink(file_));
  EXPECT_EQ(Content(folder_ / "elsewhere" / "target.json"), "text");
}

TEST_F(WrittenFileTest, AFileBeyondTheLimitChangesNothingAndNamesTheLimit) {
  ReplaceFile(file_, "old");
  std::string fault;
  {
    const FileSizeLimit limit(4096);
    fault = FaultOf([&] { ReplaceFile(file_, std::string(10'000, 'x')); }, EFBIG);
  }
  EXPECT_THAT(fault,
              AllOf(HasSubstr("result.json: cannot be written"), HasSubstr("4096 bytes"), HasSubstr("ulimit -f")));
  EXPECT_EQ(Content(file_), "old");
  EXPECT_THAT(NamesIn(folder_.path()), ElementsAre("result.json"));
}

TEST_F(WrittenFileTest, ANewFileThatCannotBeWrittenIsRemoved) {
  {
    const FileSizeLimit limit(4096);
    FaultOf([&] { CreateFile(file_, std::string(10'000, 'x')); }, EFBIG);
  }
  EXPECT_TRUE(NamesIn(folder_.path()).empty());
}

TEST_F(WrittenFileTest, ANewFileOverwritesNeitherAFileNorALink) {
  Put(file_, "old");
  EXPECT_THAT(FaultOf([&] { CreateFile(file_, "new"); }, EEXIST), HasSubstr("exists already"));
  fs::create_symlink("nowhere", folder_ / "dangling");
  FaultOf([&] { CreateFile(folder_ / "dangling", "new"); }, EEXIST);
  EXPECT_EQ(Content(file_), "old");
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
}

TEST_F(WrittenFileTest, ANameIsClaimedOnce) {
  EXPECT_TRUE(ReserveFileName(file_));
  EXPECT_FALSE(ReserveFileName(file_));
  EXPECT_EQ(fs::file_size(file_), 0U);
}

TEST_F(WrittenFileTest, KeysAreReadableByTheirOwnerAlone) {
  CreateFile(file_, "key", {kReadableByOwner, Durability::kSynced});
  EXPECT_EQ(fs::status(file_).permissions(), fs::perms::owner_read | fs::perms::owner_write);
}

TEST_F(WrittenFileTest, DevicesAndOwnDescriptorsAreStreams) {
  EXPECT_TRUE(IsStream("/dev/null"));
  EXPECT_TRUE(IsStream("/dev/stdout"));
  EXPECT_TRUE(IsStream("/dev/fd/1"));
  EXPECT_FALSE(IsStream(file_));
  Put(file_, "");
  EXPECT_FALSE(IsStream(file_));
  ReplaceFile("/dev/null", "text");
  FaultOf([] { ReplaceFile("/dev/full", "text"); }, ENOSPC);
}

TEST_F(WrittenFileTest, AppendingRefusesLinks) {
  Put(folder_ / "precious", "secrets");
  fs::create_symlink("precious", folder_ / "log");
  EXPECT_THAT(FaultOf([&] { OpenToAppend(folder_ / "log", kReadableByOwner); }, ELOOP), HasSubstr("symbolic link"));
  fs::create_hard_link(folder_ / "precious", folder_ / "hard");
  FaultOf([&] { OpenToAppend(folder_ / "hard", kReadableByOwner); }, EPERM);
  ::close(OpenToAppend(folder_ / "new", kReadableByOwner));
  ::close(OpenToAppend(folder_ / "new", kReadableByOwner));
}

TEST_F(WrittenFileTest, TemporaryFilesHaveDifferentNames) {
  const fs::path a = CreateTemporaryFile(folder_.path(), "audit-");
  const fs::path b = CreateTemporaryFile(folder_.path(), "audit-");
  EXPECT_NE(a, b);
  EXPECT_EQ(NamesIn(folder_.path()).size(), 2U);
}

}  // namespace
}  // namespace legopt::files
