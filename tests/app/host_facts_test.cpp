// Facts of a host, read from file trees as on real systems, and from this host.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "app/host_resources.h"
#include "tests/temporary_folder.h"

namespace legopt::app {
namespace {

class HostFactsTest : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories(root_ / "proc");
    std::ofstream(root_ / "proc" / name) << text;
  }
  test::TemporaryFolder root_;
};

TEST_F(HostFactsTest, TellsProcessorMemoryAndLoad) {
  Write("cpuinfo", "processor\t: 0\nmodel\t\t: 25\nmodel name\t: AMD EPYC 7B13\nflags\t\t: fpu\n\nprocessor\t: 1\n");
  Write("meminfo", "MemTotal:       24000000 kB\nMemFree:        1 kB\n");
  Write("loadavg", "1.75 1.20 0.90 3/200 4711\n");
  const HostFacts facts = ReadHostFacts(root_.path());
  EXPECT_EQ(facts.processor, "AMD EPYC 7B13");
  EXPECT_EQ(facts.memory_bytes, 24'000'000LL * 1024);
  EXPECT_EQ(HostLoad(root_.path()), 1.75);
}

TEST_F(HostFactsTest, WhatIsNotThereIsUnknown) {
  EXPECT_EQ(ReadHostFacts(root_.path()).processor, "unknown");
  EXPECT_EQ(ReadHostFacts(root_.path()).memory_bytes, 0);
  EXPECT_TRUE(std::isnan(HostLoad(root_.path())));
  Write("cpuinfo", "processor\t: 0\nmodel name\n");
  Write("meminfo", "MemTotal: many\n");
  Write("loadavg", "much\n");
  EXPECT_EQ(ReadHostFacts(root_.path()).processor, "unknown");
  EXPECT_EQ(ReadHostFacts(root_.path()).memory_bytes, 0);
  EXPECT_TRUE(std::isnan(HostLoad(root_.path())));
}

TEST(HostFacts, OfThisMachineAreKnown) {
  EXPECT_GT(ReadHostFacts().memory_bytes, 1 << 20);
  EXPECT_GE(HostLoad(), 0);
}

}  // namespace
}  // namespace legopt::app
