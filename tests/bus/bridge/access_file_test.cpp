// Access files: the reader parses the writer's output, and the writer does not follow a link planted by another user.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "bus/bridge/bridge.h"
#include "bus/bridge/uplink.h"
#include "bus/bus_error.h"
#include "tests/temporary_folder.h"

namespace legopt::bridge {
namespace {

TEST(AccessFile, WhatIsWrittenIsReadAgain) {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() / "lab.access";
  for (const std::int64_t deployment : {7, 8}) {  // the second one replaces the first
    const Access written{deployment, {ParseLinkAddress("192.168.1.2:7669"), ParseLinkAddress("127.0.0.1:7669")}};
    WriteAccessFile(file, written);
    const Access access = ReadAccessFile(file);
    EXPECT_EQ(access.deployment, deployment);
    EXPECT_EQ(access.addresses, written.addresses);
  }
  EXPECT_EQ(std::filesystem::status(file).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST(AccessFile, APlantedLinkIsRefused) {
  const test::TemporaryFolder folder;
  const std::filesystem::path other = folder.path() / "other", link = folder.path() / "lab.access";
  std::ofstream(other) << "of another program";
  std::filesystem::create_symlink(other, link);
  EXPECT_THROW(WriteAccessFile(link, {7, {ParseLinkAddress("127.0.0.1:7669")}}), bus::BusError);
  std::stringstream text;
  text << std::ifstream(other).rdbuf();
  EXPECT_EQ(text.str(), "of another program");
  EXPECT_TRUE(std::filesystem::is_symlink(link));
}

std::string FaultOf(const std::string& text) {
  const test::TemporaryFolder folder;
  const std::string file = folder.path() / "lab.access";
  std::ofstream(file, std::ios::binary) << text;
  try {
    ReadAccessFile(file);
  } catch (const bus::BusError& error) {
    return error.what();
  }
  return "";
}

TEST(AccessFile, NothingInItIsIgnored) {
  const std::string first = "legopt-access 1\n", address = "address 127.0.0.1:7669\n";
  EXPECT_EQ(FaultOf(first + "deployment 7\n# a comment\n\n" + address), "");
  EXPECT_EQ(FaultOf(first + "deployment 7\naddress 127.0.0.1:7669"), "") << "no line end";
  EXPECT_NE(FaultOf(first + "deployment 7\n" + address + "deployment 8\n").find("line 4: a second deployment"),
            std::string::npos);
  EXPECT_NE(FaultOf(first + "deployment 7 8\n").find("line 2"), std::string::npos);
  EXPECT_NE(FaultOf("").find("not an access file"), std::string::npos);
}

TEST(AccessFile, ReadingEndsAtItsLimit) {
  EXPECT_NE(FaultOf("legopt-access 1\n" + std::string(1'000'000, '#')).find("larger than"), std::string::npos);
  EXPECT_THROW(ReadAccessFile("/dev/zero"), bus::BusError);
}

}  // namespace
}  // namespace legopt::bridge
