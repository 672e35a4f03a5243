// Policy: if slots fill the granted cores, each gets one core, child processes stay on it, and two hardware threads
// count as one core.
#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <fstream>
#include <map>

#include "app/host_resources.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

using app::AffinityMask;
using app::OneOfEachCore;
using app::PinnedThread;
using app::ProcessorsOfSlots;

using Numbers = std::vector<int>;

TEST(OneOfEachCore, OfTwoThatShareACoreTheFirstGrantedIsTaken) {
  const TemporaryFolder root;
  for (const auto& [processor, siblings] : std::map<int, std::string>{{0, "0,4"}, {1, "1,5"}, {4, "0,4"}, {5, "1,5"}}) {
    const auto folder = root / ("sys/devices/system/cpu/cpu" + std::to_string(processor) + "/topology");
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "thread_siblings_list") << siblings << "\n";
  }
  const std::filesystem::path tree = root / "";
  EXPECT_EQ(OneOfEachCore(Numbers{0, 1, 4, 5}, tree), (Numbers{0, 1}));
  EXPECT_EQ(OneOfEachCore(Numbers{1, 4, 5}, tree), (Numbers{1, 4}));
  EXPECT_EQ(OneOfEachCore(Numbers{0, 4, 8, 9}, tree), (Numbers{0, 8, 9})) << "of 8 and 9 nothing is known";
}

TEST(ProcessorsOfSlots, OnlySlotsThatFillTheCoresArePinned) {
  EXPECT_EQ(ProcessorsOfSlots(2, {3, 5}), (Numbers{3, 5}));
  EXPECT_EQ(ProcessorsOfSlots(1, {3, 5}), Numbers{}) << "another worker may have taken the same one";
  EXPECT_EQ(ProcessorsOfSlots(3, {3, 5}), Numbers{});
}

TEST(PinnedThread, KeepsToOneProcessorAndGoesBack) {
  const Numbers before = AffinityMask();
  ASSERT_FALSE(before.empty());
  {
    const PinnedThread pinned(before.back());
    EXPECT_EQ(AffinityMask(), Numbers{before.back()});
    EXPECT_EQ(sched_getcpu(), before.back());
  }
  EXPECT_EQ(AffinityMask(), before);
}

TEST(PinnedThread, WhereTheKernelRefusesItStaysWhereItMay) {
  constexpr int kNotThere = 1023;
  const Numbers before = AffinityMask();
  {
    const PinnedThread pinned(kNotThere);
    EXPECT_EQ(AffinityMask(), before);
  }
  EXPECT_EQ(AffinityMask(), before);
}

}  // namespace
}  // namespace legopt::test
