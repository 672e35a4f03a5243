// The number of granted processors: the rule applied to made-up facts, control groups read from file trees as on real
// systems, and this process with a real affinity mask.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "app/host_resources.h"
#include "app/isolated_call.h"
#include "tests/temporary_folder.h"

namespace legopt::test {
namespace {

using ::testing::HasSubstr;

TEST(GrantedProcessors, NothingGrantedIsTheWholeMachine) {
  app::ProcessorFacts facts;
  facts.machine = 64;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 64);
  EXPECT_EQ(app::GrantedProcessors(facts).reason, "this machine has 64 processors");
  facts.affinity = 64;
  facts.slurm_cpus_on_node = 64;
  facts.cgroup_quota = 64.0;
  EXPECT_EQ(app::GrantedProcessors(facts).reason, "this machine has 64 processors") << "no limit limits";
}

TEST(GrantedProcessors, TheSmallestLimitDecidesAndGivesTheReason) {
  app::ProcessorFacts facts;
  facts.machine = 64;
  facts.affinity = 16;
  EXPECT_EQ(app::GrantedProcessors(facts).reason, "the affinity mask grants 16 of this machine's 64 processors");
  facts.slurm_cpus_per_task = 4;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 4);
  EXPECT_EQ(app::GrantedProcessors(facts).reason, "SLURM_CPUS_PER_TASK grants 4 of this machine's 64 processors");
  facts.cgroup_quota = 1.5;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 2) << "rounded up";
  EXPECT_THAT(app::GrantedProcessors(facts).reason, HasSubstr("CPU quota grants 2 of"));
  facts.affinity = 1;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 1);
}

TEST(GrantedProcessors, OfSlurmsNumbersThatOfTheTaskCounts) {
  app::ProcessorFacts facts;
  facts.machine = 8;
  facts.slurm_cpus_on_node = 6;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 6);
  EXPECT_THAT(app::GrantedProcessors(facts).reason, HasSubstr("SLURM_CPUS_ON_NODE"));
  facts.slurm_cpus_per_task = 7;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 7);
}

TEST(GrantedProcessors, TwoThreadsOfACoreAreOne) {
  app::ProcessorFacts facts;
  facts.machine = 8;
  facts.affinity = 8;
  facts.cores = 4;
  EXPECT_EQ(app::GrantedProcessors(facts).reason, "one to a physical core grants 4 of this machine's 8 processors");
  facts.slurm_cpus_per_task = 3;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 3);
}

TEST(GrantedProcessors, ASmallQuotaIsStillOneProcessor) {
  app::ProcessorFacts facts;
  facts.machine = 2;
  facts.cgroup_quota = 0.05;
  EXPECT_EQ(app::GrantedProcessors(facts).processors, 1);
}

// --- Control groups --------------------------------------------------------------------------------------------------

class CgroupProcessorQuotaTest : public testing::Test {
 protected:
  void Write(const std::string& file, const std::string& text) {
    std::filesystem::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }
  std::optional<double> Quota() { return app::CgroupProcessorQuota(folder_.path()); }

  TemporaryFolder folder_;
};

TEST_F(CgroupProcessorQuotaTest, Version2AndItsGroupsAbove) {
  Write("proc/self/cgroup", "0::/system.slice/worker.service\n");
  Write("proc/self/mountinfo", "29 23 0:26 / /sys/fs/cgroup rw,nosuid shared:4 - cgroup2 cgroup2 rw,nsdelegate\n");
  Write("sys/fs/cgroup/system.slice/worker.service/cpu.max", "max 100000\n");
  EXPECT_EQ(Quota(), std::nullopt);
  Write("sys/fs/cgroup/system.slice/cpu.max", "250000 100000\n");
  EXPECT_EQ(Quota(), 2.5);
  Write("sys/fs/cgroup/system.slice/worker.service/cpu.max", "150000 100000\n");
  EXPECT_EQ(Quota(), 1.5);
}

TEST_F(CgroupProcessorQuotaTest, Version1AmongOtherControllers) {
  Write("proc/self/cgroup", "5:cpuset:/batch\n4:cpu,cpuacct:/batch/job_7\n1:name=systemd:/\n0::/\n");
  Write("proc/self/mountinfo",
        "33 30 0:29 / /sys/fs/cgroup/cpuset rw - cgroup cgroup rw,cpuset\n"
        "34 30 0:30 / /sys/fs/cgroup/cpu,cpuacct rw - cgroup cgroup rw,cpu,cpuacct\n");
  Write("sys/fs/cgroup/cpu,cpuacct/batch/job_7/cpu.cfs_quota_us", "-1\n");
  Write("sys/fs/cgroup/cpu,cpuacct/batch/job_7/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(Quota(), std::nullopt);
  Write("sys/fs/cgroup/cpu,cpuacct/batch/job_7/cpu.cfs_quota_us", "300000\n");
  EXPECT_EQ(Quota(), 3.0);
}

// docker with version 1 mounts the container's own group, under its path on the host.
TEST_F(CgroupProcessorQuotaTest, AContainerThatSeesItsOwnGroupOnly) {
  Write("proc/self/cgroup", "4:cpu:/docker/0123\n");
  Write("proc/self/mountinfo", "34 30 0:30 /docker/0123 /sys/fs/cgroup/cpu ro - cgroup cgroup rw,cpu\n");
  Write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "200000\n");
  Write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(Quota(), 2.0);
}

TEST_F(CgroupProcessorQuotaTest, WhatCannotBeReadIsNoLimit) {
  EXPECT_EQ(Quota(), std::nullopt);
  Write("proc/self/cgroup", "nonsense\n0::/../outside\n");
  Write("proc/self/mountinfo", "more nonsense\n29 23 0:26 / /sys/fs/cgroup rw - cgroup2 cgroup2 rw\n");
  EXPECT_EQ(Quota(), std::nullopt);
  Write("sys/fs/cgroup/cpu.max", "0 0\n");
  EXPECT_EQ(Quota(), std::nullopt);
}

// --- This process ----------------------------------------------------------------------------------------------------

TEST(ReadProcessorFacts, TheAffinityMaskOfThisProcessCounts) {
  cpu_set_t mask;
  CPU_ZERO(&mask);
  ASSERT_EQ(sched_getaffinity(0, sizeof mask, &mask), 0);
  int first = 0;
  while (!CPU_ISSET(first, &mask)) ++first;
  // In another process, since an affinity mask stays.
  const std::string answer = CallIsolated(
      [first]() -> std::string {
        cpu_set_t one;
        CPU_ZERO(&one);
        CPU_SET(first, &one);
        if (sched_setaffinity(0, sizeof one, &one) != 0) return "refused";
        return std::to_string(app::ReadProcessorFacts().affinity.value_or(0));
      },
      {});
  if (answer == "refused") GTEST_SKIP() << "NOT TESTED: sched_setaffinity is refused here";
  EXPECT_EQ(answer, "1");
  EXPECT_EQ(app::ReadProcessorFacts().affinity, CPU_COUNT(&mask));
  EXPECT_EQ(app::ReadProcessorFacts().machine, sysconf(_SC_NPROCESSORS_ONLN));
}

TEST(ReadProcessorFacts, OfSlurmsVariablesOnlyNumbersCount) {
  const auto read = [](const char* value) {
    return CallIsolated(
        [value] {
          ::setenv("SLURM_CPUS_PER_TASK", value, 1);
          ::unsetenv("SLURM_CPUS_ON_NODE");
          const app::ProcessorFacts facts = app::ReadProcessorFacts();
          return std::to_string(facts.slurm_cpus_per_task.value_or(0)) + "|" +
                 std::to_string(facts.slurm_cpus_on_node.value_or(0));
        },
        {});
  };
  EXPECT_EQ(read("3"), "3|0");
  for (const char* nonsense : {"", "0", "-2", "4x", "many"}) EXPECT_EQ(read(nonsense), "0|0") << nonsense;
}

}  // namespace
}  // namespace legopt::test
