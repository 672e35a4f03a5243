// Pause, hold, priority and retry: what people may decide about an experiment, in virtual time.

#include <gtest/gtest.h>

#include "server/scheduler.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

constexpr int kPause = 0, kResume = 1, kHold = 2, kRelease = 3, kPriority = 4, kRetry = 5;

class SchedulerControl : public SchedulerTest {
 protected:
  // The only job of the experiment crashes until it is dead.
  void KillJob() {
    Submit(SampleSpec(1));
    Hello(kFirst);
    for (int attempt = 1; attempt <= 3; ++attempt) Finish(kFirst, LeaseOne(kFirst), 1);
    ASSERT_EQ(StateOf(1), JobState::kDead);
  }
};

TEST_F(SchedulerControl, APausedExperimentLeasesNothingAndRunningJobsFinish) {
  Submit(SampleSpec(3));
  Hello(kFirst);
  const auto running = LeaseOne(kFirst);
  EXPECT_EQ(Control(1, kPause).status, 0);
  const auto none = Lease(kFirst);
  EXPECT_EQ(none.status, 1) << "ask again later: it may be resumed";
  EXPECT_EQ(Heartbeat(kFirst, {running}).verdicts.at(0), 0);
  EXPECT_EQ(Finish(kFirst, running).status, 0);
  EXPECT_EQ(Control(1, kPause).status, 0) << "again";
  EXPECT_EQ(Control(1, kResume).status, 0);
  EXPECT_EQ(Lease(kFirst).status, 0);
}

TEST_F(SchedulerControl, AHeldExperimentGivesBackWhatRunsWithoutCharge) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const auto running = LeaseOne(kFirst);
  const auto held = Control(1, kHold, "the disk is being moved");
  EXPECT_EQ(held.status, 0);
  EXPECT_EQ(held.num_jobs, 1);
  EXPECT_EQ(StateOf(running.job_id), JobState::kQueued);
  EXPECT_EQ(Heartbeat(kFirst, {running}).verdicts.at(0), 2) << "its worker stops";
  EXPECT_EQ(Finish(kFirst, running).status, 2) << "what it still delivers is kept apart";
  EXPECT_EQ(Lease(kFirst).status, 1);
  EXPECT_EQ(Summary().control.reason, "the disk is being moved");
  EXPECT_EQ(Control(1, kRelease).status, 0);
  for (int attempt = 2; attempt <= 4; ++attempt) {
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(lease.attempt, attempt);
    Finish(kFirst, lease, 1);
  }
  EXPECT_EQ(StateOf(running.job_id), JobState::kDead) << "three attempts were charged";
}

TEST_F(SchedulerControl, PausedAndHeldAreNotTheSame) {
  Submit(SampleSpec(1));
  Control(1, kPause);
  EXPECT_EQ(Control(1, kRelease).status, 2);
  Control(1, kHold, "why");
  EXPECT_EQ(Control(1, kPause).status, 0);
  EXPECT_EQ(Summary().control.hold, db::Hold::kHeld) << "held is more than paused";
  const auto refused = Control(1, kResume);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.message.find("why"), std::string::npos);
}

TEST_F(SchedulerControl, DecisionsOutliveTheServer) {
  Submit(SampleSpec(1));
  Control(1, kHold, "why");
  Control(1, kPriority, "", -7);
  Restart();
  EXPECT_EQ(Summary().control, (db::ExperimentControl{db::Hold::kHeld, "why", -7}));
  Hello(kFirst);
  EXPECT_TRUE(Lease(kFirst).jobs.empty());
}

TEST_F(SchedulerControl, LargerPrioritiesBeginFirstAndOlderOnesAmongEquals) {
  Submit(SampleSpec(1), "s1");
  Submit(SampleSpec(1), "s2");
  Submit(SampleSpec(1), "s3");
  Hello(kFirst);
  EXPECT_EQ(Control(3, kPriority, "", 5).status, 0);
  EXPECT_EQ(Control(1, kPriority, "", -1).status, 0);
  EXPECT_EQ(Control(1, kPriority, "", -1).status, 0) << "again";
  EXPECT_EQ(LeaseOne(kFirst).experiment_id, 3);
  EXPECT_EQ(LeaseOne(kFirst).experiment_id, 2);
  EXPECT_EQ(LeaseOne(kFirst).experiment_id, 1);
}

TEST_F(SchedulerControl, ARetriedJobHasAllItsAttemptsAgain) {
  KillJob();
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  const auto retried = Control(1, kRetry);
  EXPECT_EQ(retried.status, 0);
  EXPECT_EQ(retried.num_jobs, 1);
  EXPECT_EQ(Control(1, kRetry).num_jobs, 0) << "heard twice";
  EXPECT_EQ(Summary().state, db::ExperimentState::kActive);
  for (int attempt = 4; attempt <= 5; ++attempt) Finish(kFirst, LeaseOne(kFirst), 1);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  const auto last = LeaseOne(kFirst);
  EXPECT_EQ(last.attempt, 6);
  EXPECT_EQ(Finish(kFirst, last).status, 0);
  EXPECT_EQ(StateOf(1), JobState::kDone);
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
}

// Found by the simulation: its last jobs ended while it was paused, and nobody could resume what was tried again.
TEST_F(SchedulerControl, AnExperimentThatEndsWhilePausedIsNotPausedWhenRetried) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    const auto lease = LeaseOne(kFirst);
    if (attempt == 3) Control(1, kPause);
    Finish(kFirst, lease, 1);
  }
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  EXPECT_EQ(Summary().control.hold, db::Hold::kNone);
  EXPECT_EQ(Control(1, kRetry).num_jobs, 1);
  EXPECT_EQ(Finish(kFirst, LeaseOne(kFirst)).status, 0);
}

TEST_F(SchedulerControl, ARetryFindsExperimentsThatWereForgotten) {
  KillJob();
  Advance(options_.retention + 1s);
  EXPECT_EQ(Control(1, kRetry).num_jobs, 1);
  Hello(kFirst);
  EXPECT_EQ(Finish(kFirst, LeaseOne(kFirst)).status, 0);
  EXPECT_EQ(StateOf(1), JobState::kDone);
}

TEST_F(SchedulerControl, LateReportsOfEarlierAttemptsStayStale) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto late = LeaseOne(kFirst);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    if (attempt > 1) LeaseOne(kFirst);
    Advance(12s);
    Hello(kFirst);
  }
  ASSERT_EQ(StateOf(1), JobState::kDead);
  Control(1, kRetry);
  EXPECT_EQ(Finish(kFirst, late).status, 2);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
}

TEST_F(SchedulerControl, RefusalsNameTheExperiment) {
  EXPECT_EQ(Control(9, kPause).status, 1);
  Submit(SampleSpec(1));
  EXPECT_EQ(Control(1, kRetry).num_jobs, 0);
  Cancel(1);
  for (const int action : {kPause, kResume, kHold, kRelease, kPriority, kRetry}) {
    const auto reply = Control(1, action, action == kHold ? "why" : "");
    EXPECT_EQ(reply.status, 2) << action;
    EXPECT_NE(reply.message.find("experiment 1"), std::string::npos) << reply.message;
  }
}

}  // namespace
}  // namespace legopt::server
