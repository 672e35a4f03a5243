// Policy: Slurm's output is parsed as printed. Unexpected parts are shown and never cause a failure.
#include <gtest/gtest.h>

#include "client/pool/slurm_pool.h"

namespace legopt::client {
namespace {

TEST(SlurmArray, LinesBecomeElements) {
  const auto elements = ParseElements(
      "17_0|RUNNING|1:05|n1\n17_[1-2]|PENDING|0:00|(Nodes required for job are DOWN|DRAINED)\n\nslurm_load_jobs "
      "error\n");
  ASSERT_EQ(elements.size(), 2U);
  EXPECT_EQ(elements[0].id, "17_0");
  EXPECT_EQ(elements[0].state, "RUNNING");
  EXPECT_EQ(elements[0].run_time, "1:05");
  EXPECT_EQ(elements[0].place, "n1");
  EXPECT_EQ(elements[1].place, "(Nodes required for job are DOWN|DRAINED)");
}

TEST(SlurmArray, ASummaryCountsAndSaysWhyTheOthersWait) {
  EXPECT_EQ(Summary({{"1_0", "RUNNING", "n1", "0:01"},
                     {"1_1", "RUNNING", "n2", "0:01"},
                     {"1_2", "PENDING", "(Resources)", "0:00"}}),
            "1 pending (Resources), 2 running");
  EXPECT_EQ(Summary({}), "none");
}

}  // namespace
}  // namespace legopt::client
