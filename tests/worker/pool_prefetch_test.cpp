// Prefetched leases: their number, and the fate of those that wait. Pool in virtual time.

#include <gtest/gtest.h>

#include "tests/worker/pool_harness.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(PoolPrefetchTest, FetchesMoreAheadTheSlowerTheAnswers) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.Advance(milliseconds(10));
  harness.FinishJob(harness.Take<AssignJob>().at(0));
  EXPECT_EQ(harness.Take<CallLease>().at(0).request.max_jobs, 1 + 6);
  harness.Advance(milliseconds(100));
  harness.ReplyLease({SampleLease(2)});
  EXPECT_EQ(harness.Take<CallLease>().at(0).request.max_jobs, 8) << "four times the mean answer, 20 ms so far";
  harness.Advance(seconds(1));
  harness.ReplyLease({SampleLease(3)});
  EXPECT_EQ(harness.Take<CallLease>().at(0).request.max_jobs, 25 - 1) << "250 ms at most";
}

TEST(PoolPrefetchTest, GivesBackWhatWouldWaitLong) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.Advance(milliseconds(10));
  harness.FinishJob(harness.Take<AssignJob>().at(0));
  harness.ReplyResult(harness.Take<CallResult>().at(0).key);
  harness.ReplyLease({SampleLease(2), SampleLease(3), SampleLease(4)});
  ASSERT_EQ(harness.Take<AssignJob>().at(0).lease.job_id, 2) << "begun in the order of the leases";
  harness.Run(milliseconds(1990));  // not a short job
  EXPECT_TRUE(harness.Take<CallResult>().empty());
  harness.Run(milliseconds(20));
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 2U);
  for (const CallResult& result : results) {
    EXPECT_GE(result.key.job_id, 3);
    EXPECT_EQ(result.request->outcome, static_cast<int>(ReportedOutcome::kCancelled));
    EXPECT_EQ(result.request->message, "released: no slot was free for it");
  }
  EXPECT_EQ(harness.pool.num_running(), 1U);
}

TEST(PoolPrefetchTest, KeepsWhatWaitsForAJobProcessToStart) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.Advance(milliseconds(10));
  harness.FinishJob(harness.Take<AssignJob>().at(0));
  harness.Take<CallResult>();
  harness.ReplyLease({SampleLease(2), SampleLease(3)});
  harness.Exit(harness.Take<AssignJob>().at(0).slot, {11, 0, "", 0});
  EXPECT_EQ(harness.Take<CallResult>().size(), 1U) << "of the crash";
  harness.Run(seconds(3));
  EXPECT_TRUE(harness.Take<CallResult>().empty());
  harness.ChildrenReady();
  EXPECT_EQ(harness.Take<AssignJob>().at(0).lease.job_id, 3);
}

}  // namespace
}  // namespace legopt::worker
