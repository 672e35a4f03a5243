// Policy: reading any file takes no more memory than its limit.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "legopt/input/text.h"
#include "tests/input/faults.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

using ::testing::HasSubstr;

TEST(FileText, AllBytesAreRead) {
  const TemporaryFolder folder;
  for (const std::size_t size : {0U, 1U, 65535U, 65536U, 65537U, 300000U}) {
    const std::string text(size, 'x');
    std::ofstream(folder / "a") << text;
    EXPECT_EQ(ReadFileText(folder / "a", 300000), text);
  }
}

TEST(FileText, TheLimitIsOfBytes) {
  const TemporaryFolder folder;
  std::ofstream(folder / "a") << "12345";
  EXPECT_EQ(ReadFileText(folder / "a", 5), "12345");
  EXPECT_THAT(FaultOf([&] { ReadFileText(folder / "a", 4); }), HasSubstr("is larger than"));
  EXPECT_THAT(FaultOf([&] { ReadFileText("/dev/zero", 1000); }), HasSubstr("is larger than"));
}

TEST(FileText, WhatCannotBeReadIsNamedWithItsCause) {
  const TemporaryFolder folder;
  EXPECT_THAT(FaultOf([&] { ReadFileText(folder / "none", 10); }), HasSubstr("No such file"));
  EXPECT_THAT(FaultOf([&] { ReadFileText(folder.path(), 10); }), HasSubstr("it is a folder"));
}

}  // namespace
}  // namespace legopt::test
