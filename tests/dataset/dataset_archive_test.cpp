// Policy: packing and unpacking preserve the dataset, and an untrusted archive writes nothing outside its folder.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zstd.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "legopt/dataset/internal/dataset_content.h"
#include "legopt/types/input_error.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string Compressed(const std::string& plain) {
  std::string packed(ZSTD_compressBound(plain.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 1));
  return packed;
}

std::string ArchiveOf(const std::string& path, const std::string& bytes, std::size_t told_bytes) {
  const nlohmann::json table = {{"format", "legopt-dataset-archive/1"},
                                {"files", {{{"path", path}, {"bytes", told_bytes}}}}};
  return Compressed(table.dump() + "\n" + bytes);
}

class DatasetArchiveTest : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(out_); }

  void ExpectRefused(const std::string& archive, const std::string& why) {
    try {
      UnpackDataset(archive, out_, {});
      ADD_FAILURE() << "unpacked: " << why;
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(why));
    }
  }

  TemporaryFolder folder_;
  fs::path out_ = folder_ / "inside/out";
};

TEST_F(DatasetArchiveTest, ADatasetComesBackWithItsContentAndName) {
  const SyntheticFolder source(folder_ / "source");
  UnpackDataset(PackDataset(source.path(), {}), out_, {});
  const auto before = Dataset::Load(source.path());
  const auto after = Dataset::Load(out_);
  EXPECT_EQ(after->content_hash(), before->content_hash());
  EXPECT_EQ(after->name(), before->name());
  EXPECT_EQ(HashOfDataset(out_, {}), before->content_hash());
}

TEST_F(DatasetArchiveTest, AWrongByteIsAnotherContent) {
  const SyntheticFolder source(folder_ / "source");
  std::string plain(kMaxUnpackedBytes >> 4, '\0');
  const std::string archive = PackDataset(source.path(), {});
  plain.resize(ZSTD_decompress(plain.data(), plain.size(), archive.data(), archive.size()));
  const std::string before = "<mass value='";
  const auto place = plain.find(before);
  ASSERT_NE(place, std::string::npos);
  char& digit = plain[place + before.size()];
  digit = digit == '9' ? '8' : '9';
  UnpackDataset(Compressed(plain), out_, {});
  EXPECT_NE(HashOfDataset(out_, {}), HashOfDataset(source.path(), {}));
}

TEST_F(DatasetArchiveTest, NoNameLeadsOutOfTheFolder) {
  for (const char* path : {"../outside", "/tmp/outside", "a/../../outside", "..", ".", "", "a/", "a//b", "./a"}) {
    ExpectRefused(ArchiveOf(path, "x", 1), "outside of its folder");
  }
  EXPECT_TRUE(fs::is_empty(out_));
  EXPECT_EQ(std::distance(fs::directory_iterator(out_.parent_path()), {}), 1);
}

TEST_F(DatasetArchiveTest, DamageIsRefused) {
  const std::string whole = ArchiveOf("a", "content", 7);
  EXPECT_NO_THROW(UnpackDataset(whole, out_, {}));
  ExpectRefused("", "is none");
  ExpectRefused("no archive at all", "is none");
  ExpectRefused(whole.substr(0, whole.size() - 1), "is damaged");
  ExpectRefused(ArchiveOf("a", "content", 8), "shorter than its table says");
  ExpectRefused(ArchiveOf("a", "content", 6), "longer than its table says");
  ExpectRefused(Compressed("no table"), "no table of its files");
  ExpectRefused(Compressed("[]\n"), "no table of its files");
  ExpectRefused(Compressed(R"({"format": "another/1", "files": []})"
                           "\n"),
                "use the same release");
  ExpectRefused(Compressed(R"({"format": "legopt-dataset-archive/1", "files": [{"path": 1, "bytes": -1}]})"
                           "\n"),
                "names no file");
}

TEST_F(DatasetArchiveTest, AFewBytesDoNotBecomeAFullDisk) {
  ExpectRefused(Compressed(std::string(kMaxUnpackedBytes + 1, ' ')), "is too large");
  ExpectRefused(Compressed(std::string(std::size_t{200} << 20, '\0')), "is too large");
}

TEST_F(DatasetArchiveTest, AHugeTableIsNotParsed) {
  ExpectRefused(Compressed(std::string(50'000'000, '[') + "\n"), "no table of its files");
  ExpectRefused(Compressed(std::string(5'000'000, '[') + "\n"), "no table of its files");
  ExpectRefused(Compressed(R"({"format": "legopt-dataset-archive/1", "files": [], "files": []})"
                           "\n"),
                "no table of its files");
}

TEST_F(DatasetArchiveTest, LongPathsAreRefused) {
  std::string deep;
  for (int i = 0; i < 40; ++i) deep += "d/";
  ExpectRefused(ArchiveOf(deep + "a", "x", 1), "too long a path");
  ExpectRefused(ArchiveOf(std::string(1100, 'a'), "x", 1), "too long a path");
}

TEST_F(DatasetArchiveTest, TheTableIsParsedUnderTheGuard) {
  int calls = 0;
  const ReadGuard guard = [&calls](const std::function<std::string()>& read, const ReadLimits& /*limits*/) {
    ++calls;
    return read();
  };
  UnpackDataset(ArchiveOf("a/b c\n", "content", 7), out_, guard);
  EXPECT_EQ(calls, 1);
  EXPECT_TRUE(fs::exists(out_ / "a/b c\n"));
  const ReadGuard failing = [](const std::function<std::string()>&, const ReadLimits&) -> std::string {
    throw GuardedReadError("it ended with signal 11");
  };
  EXPECT_THROW(UnpackDataset(ArchiveOf("a", "content", 7), out_, failing), InputError);
}

TEST_F(DatasetArchiveTest, ManyFilesOfManyPiecesComeBack) {
  const std::string large(300'000, 'x');
  const nlohmann::json table = {
      {"format", "legopt-dataset-archive/1"},
      {"files", {{{"path", "a"}, {"bytes", 300'000}}, {{"path", "b"}, {"bytes", 0}}, {{"path", "c/d"}, {"bytes", 3}}}}};
  UnpackDataset(Compressed(table.dump() + "\n" + large + "end"), out_, {});
  EXPECT_EQ(fs::file_size(out_ / "a"), 300'000U);
  EXPECT_EQ(fs::file_size(out_ / "b"), 0U);
  EXPECT_EQ(fs::file_size(out_ / "c/d"), 3U);
}

TEST_F(DatasetArchiveTest, WhatIsTooLargeToTravelIsSaid) {
  const SyntheticFolder source(folder_ / "source");
  std::ofstream mesh(source.path() / "meshes/rock.obj", std::ios::app);
  mesh << "# ";
  unsigned number = 1;
  for (std::size_t i = 0; i < kMaxArchiveBytes + kMaxArchiveBytes / 2; ++i) {
    number = number * 1664525 + 1013904223;
    mesh.put(static_cast<char>('!' + (number >> 24) % 94));
  }
  mesh << std::endl;
  try {
    PackDataset(source.path(), {});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("too large to travel"));
  }
}

}  // namespace
}  // namespace legopt::test
