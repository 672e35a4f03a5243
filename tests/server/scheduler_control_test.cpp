// Pause, resume, priority and retry: operator commands on an experiment, in virtual time.

#include <gtest/gtest.h>

#include "server/scheduler.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

using enum ControlAction;

class SchedulerControl : public SchedulerTest {
 protected:
  // Lets the only job of the experiment crash until it is dead.
  void KillJob() {
    Submit(SampleSpec(1));
    Hello(kFirst);
    for (int attempt = 1; attempt <= 3; ++attempt) Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCrashed);
    ASSERT_EQ(StateOf(1), JobState::kDead);
  }
};

TEST_F(SchedulerControl, APausedExperimentLeasesNothingAndRunningJobsFinish) {
  Submit(SampleSpec(3));
  Hello(kFirst);
  const auto running = LeaseOne(kFirst);
  EXPECT_EQ(StatusOf(Control(1, kPause)), ControlStatus::kOk);
  const auto none = Lease(kFirst);
  EXPECT_EQ(StatusOf(none), LeaseStatus::kNoneNow) << "ask again later: it may be resumed";
  EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {running})), LeaseVerdict::kContinue);
  EXPECT_EQ(StatusOf(Finish(kFirst, running)), ResultStatus::kAccepted);
  EXPECT_EQ(StatusOf(Control(1, kPause)), ControlStatus::kOk) << "again";
  EXPECT_EQ(StatusOf(Control(1, kResume)), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kLeased);
}

TEST_F(SchedulerControl, APauseNowReleasesTheRunningJobsWithoutCharge) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const auto running = LeaseOne(kFirst);
  const auto paused = Control(1, kPauseNow, "the disk is being moved");
  EXPECT_EQ(StatusOf(paused), ControlStatus::kOk);
  EXPECT_EQ(paused.num_jobs, 1);
  EXPECT_EQ(StateOf(running.job_id), JobState::kQueued);
  EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {running})), LeaseVerdict::kUnknownLease) << "its worker stops";
  EXPECT_EQ(StatusOf(Finish(kFirst, running)), ResultStatus::kStale) << "what it still delivers is kept apart";
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow);
  EXPECT_EQ(Summary().control.reason, "the disk is being moved");
  EXPECT_EQ(StatusOf(Control(1, kResume)), ControlStatus::kOk);
  for (int attempt = 2; attempt <= 4; ++attempt) {
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(lease.attempt, attempt);
    Finish(kFirst, lease, ReportedOutcome::kCrashed);
  }
  EXPECT_EQ(StateOf(running.job_id), JobState::kDead) << "three attempts were charged";
}

TEST_F(SchedulerControl, APauseNowAfterAPauseStopsTheRunningJobs) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const auto running = LeaseOne(kFirst);
  EXPECT_EQ(Control(1, kPause, "why").num_jobs, 0);
  EXPECT_EQ(StateOf(running.job_id), JobState::kLeased);
  EXPECT_EQ(Control(1, kPauseNow).num_jobs, 1);
  EXPECT_EQ(StateOf(running.job_id), JobState::kQueued);
  EXPECT_EQ(Summary().control.reason, "why") << "a pause without a reason keeps it";
  const auto again = Control(1, kPauseNow);
  EXPECT_EQ(StatusOf(again), ControlStatus::kOk);
  EXPECT_EQ(again.message, "experiment 1 was paused already");
  EXPECT_EQ(StatusOf(Control(1, kPause, "another")), ControlStatus::kOk);
  EXPECT_EQ(Summary().control.reason, "another");
}

TEST_F(SchedulerControl, ResumeEndsEveryPauseAndItsReason) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (const ControlAction pause : {kPause, kPauseNow}) {
    Control(1, pause, "why");
    EXPECT_TRUE(Lease(kFirst).jobs.empty());
    EXPECT_EQ(StatusOf(Control(1, kResume)), ControlStatus::kOk);
    EXPECT_EQ(Summary().control, db::ExperimentControl{});
  }
  EXPECT_EQ(Control(1, kResume).message, "experiment 1 was not paused");
  EXPECT_EQ(LeaseOne(kFirst).attempt, 1);
}

TEST_F(SchedulerControl, ReleaseOfOlderClientsIsRefusedWithItsSuccessor) {
  Submit(SampleSpec(1));
  Control(1, kPauseNow, "why");
  const auto reply = Control(1, kRelease);
  EXPECT_EQ(StatusOf(reply), ControlStatus::kRefused);
  EXPECT_NE(reply.message.find("resume it"), std::string::npos) << reply.message;
  EXPECT_EQ(Summary().control.hold, db::ExperimentHold::kPaused);
}

TEST_F(SchedulerControl, DecisionsOutliveTheServer) {
  Submit(SampleSpec(1));
  Control(1, kPauseNow, "why");
  Control(1, kPriority, "", -7);
  Restart();
  EXPECT_EQ(Summary().control, (db::ExperimentControl{db::ExperimentHold::kPaused, "why", -7}));
  Hello(kFirst);
  EXPECT_TRUE(Lease(kFirst).jobs.empty());
}

TEST_F(SchedulerControl, LargerPrioritiesBeginFirstAndOlderOnesAmongEquals) {
  Submit(SampleSpec(1), "s1");
  Submit(SampleSpec(1), "s2");
  Submit(SampleSpec(1), "s3");
  Hello(kFirst);
  EXPECT_EQ(StatusOf(Control(3, kPriority, "", 5)), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Control(1, kPriority, "", -1)), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Control(1, kPriority, "", -1)), ControlStatus::kOk) << "again";
  EXPECT_EQ(LeaseOne(kFirst).experiment_id, 3);
  EXPECT_EQ(LeaseOne(kFirst).experiment_id, 2);
  EXPECT_EQ(LeaseOne(kFirst).experiment_id, 1);
}

TEST_F(SchedulerControl, ARetriedJobHasAllItsAttemptsAgain) {
  KillJob();
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  const auto retried = Control(1, kRetry);
  EXPECT_EQ(StatusOf(retried), ControlStatus::kOk);
  EXPECT_EQ(retried.num_jobs, 1);
  EXPECT_EQ(Control(1, kRetry).num_jobs, 0) << "heard twice";
  EXPECT_EQ(Summary().state, db::ExperimentState::kActive);
  for (int attempt = 4; attempt <= 5; ++attempt) Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCrashed);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  const auto last = LeaseOne(kFirst);
  EXPECT_EQ(last.attempt, 6);
  EXPECT_EQ(StatusOf(Finish(kFirst, last)), ResultStatus::kAccepted);
  EXPECT_EQ(StateOf(1), JobState::kDone);
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
}

// Regression found by the simulation: the last jobs ended while the experiment was paused, and retried jobs could not
// be resumed.
TEST_F(SchedulerControl, AnExperimentThatEndsWhilePausedIsNotPausedWhenRetried) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    const auto lease = LeaseOne(kFirst);
    if (attempt == 3) Control(1, kPause);
    Finish(kFirst, lease, ReportedOutcome::kCrashed);
  }
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  EXPECT_EQ(Summary().control.hold, db::ExperimentHold::kNone);
  EXPECT_EQ(Control(1, kRetry).num_jobs, 1);
  EXPECT_EQ(StatusOf(Finish(kFirst, LeaseOne(kFirst))), ResultStatus::kAccepted);
}

TEST_F(SchedulerControl, ARetryFindsExperimentsThatWereForgotten) {
  KillJob();
  Advance(options_.retention + 1s);
  EXPECT_EQ(Control(1, kRetry).num_jobs, 1);
  Hello(kFirst);
  EXPECT_EQ(StatusOf(Finish(kFirst, LeaseOne(kFirst))), ResultStatus::kAccepted);
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
  EXPECT_EQ(StatusOf(Finish(kFirst, late)), ResultStatus::kStale);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
}

TEST_F(SchedulerControl, RefusalsNameTheExperiment) {
  EXPECT_EQ(StatusOf(Control(9, kPause)), ControlStatus::kUnknownExperiment);
  Submit(SampleSpec(1));
  EXPECT_EQ(Control(1, kRetry).num_jobs, 0);
  Cancel(1);
  for (const ControlAction action : {kPause, kResume, kPauseNow, kRelease, kPriority, kRetry}) {
    const auto reply = Control(1, action, action == kPauseNow ? "why" : "");
    EXPECT_EQ(StatusOf(reply), ControlStatus::kRefused) << ToString(action);
    EXPECT_NE(reply.message.find("experiment 1"), std::string::npos) << reply.message;
  }
}

}  // namespace
}  // namespace legopt::server
