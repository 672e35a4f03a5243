// Policy: a cache in a folder returns what was written, or nothing: damaged files, other keys and old entries cost time
// only.
#include "app/folder_cache.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <string>
#include <vector>

#include "tests/temporary_folder.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;

class FolderCacheTest : public testing::Test {
 protected:
  std::vector<fs::path> Files() const {
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder_.path() / "cache")) files.push_back(entry.path());
    return files;
  }

  test::TemporaryFolder folder_;
  FolderCache cache_{folder_.path() / "cache"};
};

TEST_F(FolderCacheTest, ReturnsWhatWasWritten) {
  const std::string bytes("a\0b\n", 4);
  EXPECT_FALSE(cache_.Read("ab12").has_value());
  cache_.Write("ab12", bytes);
  EXPECT_EQ(cache_.Read("ab12"), bytes);
  EXPECT_EQ(FolderCache(folder_.path() / "cache").Read("ab12"), bytes) << "another process";
  EXPECT_FALSE(cache_.Read("ab13").has_value());
  cache_.Write("ab12", "new");
  EXPECT_EQ(cache_.Read("ab12"), "new");
}

TEST_F(FolderCacheTest, DamagedFilesAreIgnored) {
  cache_.Write("ab12", "some bytes");
  ASSERT_EQ(Files().size(), 1U);
  const fs::path file = Files().front();
  fs::resize_file(file, fs::file_size(file) - 1);
  EXPECT_FALSE(cache_.Read("ab12").has_value());
  std::ofstream(file) << "garbage";
  EXPECT_FALSE(cache_.Read("ab12").has_value());
  cache_.Write("ab12", "some bytes");
  EXPECT_EQ(cache_.Read("ab12"), "some bytes");
}

TEST_F(FolderCacheTest, AFileThatChangesAfterItWasReadIsCheckedAgain) {
  cache_.Write("ab12", "some bytes");
  EXPECT_EQ(cache_.Read("ab12"), "some bytes");
  EXPECT_EQ(cache_.Read("ab12"), "some bytes");
  std::fstream file(Files().front(), std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(-1, std::ios::end).put('X').flush();
  EXPECT_FALSE(cache_.Read("ab12").has_value());
}

TEST_F(FolderCacheTest, KeysAreHexadecimal) {
  for (const char* key : {"", "../ab", "AB", "g"}) {
    cache_.Write(key, "bytes");
    EXPECT_FALSE(cache_.Read(key).has_value()) << key;
  }
  EXPECT_FALSE(fs::exists(folder_.path() / "cache"));
}

TEST_F(FolderCacheTest, TheEntriesUsedLastRemain) {
  const FolderCache small(folder_.path() / "cache", 2'000);
  const std::string bytes(400, 'x');
  for (const char* key : {"a1", "a2", "a3", "a4"}) {
    small.Write(key, bytes);
    for (const fs::path& file : Files()) {
      fs::last_write_time(file, fs::last_write_time(file) - std::chrono::hours(1));  // older than the next
    }
  }
  EXPECT_TRUE(small.Read("a1").has_value());  // used now
  small.Write("a5", bytes);
  EXPECT_TRUE(small.Read("a1").has_value());
  EXPECT_FALSE(small.Read("a2").has_value());
  EXPECT_TRUE(small.Read("a5").has_value());
  EXPECT_LE(Files().size(), 4U);
}

TEST_F(FolderCacheTest, AFolderThatCannotBeMadeIsNoError) {
  std::ofstream(folder_.path() / "file") << "no folder";
  const FolderCache cache(folder_.path() / "file" / "cache");
  cache.Write("ab12", "bytes");
  EXPECT_FALSE(cache.Read("ab12").has_value());
}

}  // namespace
}  // namespace legopt
