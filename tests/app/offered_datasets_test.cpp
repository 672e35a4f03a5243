// Policy: a server serves the files of one folder whose name is a hash, and no other files.
#include <gtest/gtest.h>

#include <fstream>

#include "app/data_folder.h"
#include "legopt/types/input_error.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

using app::ArchiveName;
using app::OfferedDatasets;

const std::string kHash(64, 'a'), kOther(64, 'b');
constexpr std::size_t kMost = 100;

class OfferedDatasetsTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) { std::ofstream(folder_ / name) << text; }

  TemporaryFolder folder_;
};

TEST_F(OfferedDatasetsTest, WhatIsThereIsFoundByItsHash) {
  Write(ArchiveName(kHash), "one");
  OfferedDatasets offered(folder_.path());
  ASSERT_NE(offered.Find(kHash, kMost), nullptr);
  EXPECT_EQ(*offered.Find(kHash, kMost), "one");
  EXPECT_EQ(offered.Find(kOther, kMost), nullptr);
  Write(ArchiveName(kOther), "two");
  ASSERT_NE(offered.Find(kOther, kMost), nullptr) << "put there while the server runs";
  EXPECT_EQ(*offered.Find(kOther, kMost), "two");
  EXPECT_EQ(*offered.Find(kHash, kMost), "one");
}

TEST_F(OfferedDatasetsTest, NothingElseIsFound) {
  Write(ArchiveName(kHash), std::string(kMost + 1, 'x'));
  Write("secret", "secret");
  OfferedDatasets offered(folder_.path());
  EXPECT_EQ(offered.Find(kHash, kMost), nullptr) << "too large";
  EXPECT_EQ(offered.Find("secret", kMost), nullptr);
  EXPECT_EQ(offered.Find("../" + folder_.path().filename().string() + "/secret", kMost), nullptr);
}

TEST_F(OfferedDatasetsTest, WithoutAFolderThereIsNone) {
  EXPECT_EQ(OfferedDatasets(std::nullopt).Find(kHash, kMost), nullptr);
  EXPECT_THROW(OfferedDatasets(folder_ / "missing"), InputError);
}

}  // namespace
}  // namespace legopt::test
