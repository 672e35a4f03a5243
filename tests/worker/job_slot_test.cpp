#include "worker/job_slot.h"

#include <gtest/gtest.h>

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Command = JobSlot::Command;
using State = JobSlot::State;

JobSlot IdleSlot() {
  JobSlot slot{SlotTimes{}};
  EXPECT_EQ(slot.Tick(microseconds(0)), Command::kStart);
  EXPECT_TRUE(slot.Ready());
  return slot;
}

TEST(JobSlotTest, StartsAtOnceAndRunsAJob) {
  JobSlot slot = IdleSlot();
  EXPECT_EQ(slot.state(), State::kIdle);
  EXPECT_EQ(slot.deadline(), microseconds::max());
  const std::uint64_t sequence = slot.Assign(seconds(1), seconds(5));
  EXPECT_TRUE(slot.has_job());
  EXPECT_TRUE(slot.Finish(sequence));
  EXPECT_EQ(slot.state(), State::kIdle);
  EXPECT_FALSE(slot.has_job());
}

TEST(JobSlotTest, KillsASolverAtTheLimitPlusOneSecond) {
  JobSlot slot = IdleSlot();
  slot.Assign(seconds(10), seconds(5));
  EXPECT_EQ(slot.Tick(milliseconds(15'999)), Command::kNone);
  EXPECT_EQ(slot.Tick(seconds(16)), Command::kKill);
  EXPECT_EQ(slot.stop_reason(), StopReason::kTimeLimit);
  EXPECT_EQ(slot.Tick(seconds(17)), Command::kNone) << "killed once";
}

TEST(JobSlotTest, JudgingHasATimeLimitOfItsOwn) {
  JobSlot slot = IdleSlot();
  const std::uint64_t sequence = slot.Assign(seconds(10), seconds(5));
  EXPECT_TRUE(slot.Judging(seconds(15), sequence));
  EXPECT_EQ(slot.Tick(seconds(17)), Command::kNone);
  EXPECT_EQ(slot.Tick(seconds(15) + SlotTimes{}.judge_limit), Command::kKill);
}

TEST(JobSlotTest, ACancelledJobMayEndByItselfBeforeItIsKilled) {
  JobSlot slot = IdleSlot();
  const std::uint64_t sequence = slot.Assign(seconds(1), seconds(60));
  EXPECT_EQ(slot.StopJob(seconds(2), StopReason::kCancelled), Command::kCancel);
  EXPECT_EQ(slot.StopJob(seconds(2), StopReason::kUnknownLease), Command::kNone) << "is being stopped already";
  EXPECT_EQ(slot.stop_reason(), StopReason::kCancelled);
  EXPECT_TRUE(slot.Finish(sequence));
  EXPECT_EQ(slot.state(), State::kIdle) << "the process lives on";
}

TEST(JobSlotTest, ACancelledJobThatDoesNotListenIsKilled) {
  JobSlot slot = IdleSlot();
  slot.Assign(seconds(1), seconds(60));
  slot.StopJob(seconds(2), StopReason::kCancelled);
  EXPECT_EQ(slot.Tick(milliseconds(2'499)), Command::kNone);
  EXPECT_EQ(slot.Tick(milliseconds(2'500)), Command::kKill);
  EXPECT_EQ(slot.stop_reason(), StopReason::kCancelled);
}

TEST(JobSlotTest, ResultsOfOtherJobsAreRefused) {
  JobSlot slot = IdleSlot();
  EXPECT_FALSE(slot.Finish(0));
  const std::uint64_t first = slot.Assign(seconds(1), seconds(60));
  EXPECT_FALSE(slot.Finish(first + 1));
  EXPECT_TRUE(slot.Finish(first));
  EXPECT_FALSE(slot.Finish(first)) << "once";
  EXPECT_FALSE(slot.Judging(seconds(2), first));
}

TEST(JobSlotTest, RestartsAtOnceAfterACrashOfAJob) {
  JobSlot slot = IdleSlot();
  slot.Assign(seconds(1), seconds(60));
  slot.Exited(seconds(3));
  EXPECT_FALSE(slot.has_job());
  EXPECT_EQ(slot.Tick(seconds(3)), Command::kStart);
}

TEST(JobSlotTest, BacksOffWhenStartsFailAndForgetsThatWhenOneSucceeds) {
  JobSlot slot{SlotTimes{}};
  microseconds now(0);
  microseconds last_wait(0);
  for (int failure = 1; failure <= 12; ++failure) {
    ASSERT_EQ(slot.Tick(now), Command::kStart);
    slot.Exited(now);
    EXPECT_EQ(slot.failed_starts(), failure);
    const microseconds wait = slot.deadline() - now;
    EXPECT_GE(wait, last_wait);
    EXPECT_LE(wait, SlotTimes{}.last_restart);
    EXPECT_EQ(slot.Tick(slot.deadline() - microseconds(1)), Command::kNone);
    last_wait = wait;
    now = slot.deadline();
  }
  EXPECT_EQ(last_wait, SlotTimes{}.last_restart);
  EXPECT_EQ(slot.Tick(now), Command::kStart);
  EXPECT_TRUE(slot.Ready());
  slot.Exited(now);
  EXPECT_EQ(slot.Tick(now), Command::kStart);
}

TEST(JobSlotTest, AStartThatHangsIsKilledAndCountsAsFailed) {
  JobSlot slot{SlotTimes{}};
  slot.Tick(seconds(0));
  EXPECT_EQ(slot.Tick(SlotTimes{}.start_limit), Command::kKill);
  EXPECT_EQ(slot.failed_starts(), 1);
  slot.Exited(SlotTimes{}.start_limit);
  EXPECT_EQ(slot.failed_starts(), 1);
  EXPECT_GT(slot.deadline(), SlotTimes{}.start_limit);
}

TEST(JobSlotTest, ReadyAtTheWrongTimeIsRefused) {
  JobSlot slot = IdleSlot();
  EXPECT_FALSE(slot.Ready());
}

}  // namespace
}  // namespace legopt::worker
