// Time, restarts and cancellation: policies of the scheduler that protect running work, in virtual time.

#include <gtest/gtest.h>

#include "server/scheduler.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

// --- Time ------------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, SilentWorkersLeaseExpiresAfterLeaseAndGrace) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  Heartbeat(kFirst, {lease});
  Advance(options_.lease + options_.grace - 1ms);
  EXPECT_EQ(StateOf(1), JobState::kLeased);
  Advance(200ms);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  EXPECT_EQ(scheduler_->counters().leases_expired, 1U);
  Hello(kSecond);
  const auto second = LeaseOne(kSecond);
  EXPECT_EQ(second.attempt, 2);
  EXPECT_NE(second.token, lease.token);
}

TEST_F(SchedulerTest, HeartbeatsRenewForEver) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  for (int i = 0; i < 100; ++i) {
    Advance(1s);
    EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {lease})), LeaseVerdict::kContinue);
  }
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
}

TEST_F(SchedulerTest, ExpiryConsumesAttempts) {
  Submit(SampleSpec(1));
  for (int attempt = 1; attempt <= 3; ++attempt) {
    Hello(kFirst);
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(lease.attempt, attempt);
    Advance(12s);
  }
  EXPECT_EQ(StateOf(1), JobState::kDead);
}

// A command that ends has stopped its workers. The next command must not wait until their leases expire.
TEST_F(SchedulerTest, RunningJobsAreReleasedWithoutCharge) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  scheduler_->RequeueAllRunning(now_, "the workers have ended", ops_);
  Commit();
  EXPECT_EQ(StateOf(lease.job_id), JobState::kQueued);
  EXPECT_EQ(scheduler_->counters().attempts_returned, 1U);
  EXPECT_EQ(store_.FindAttempt(lease.job_id, 1)->outcome, db::AttemptOutcome::kReturned);
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kStale) << "a result that comes nevertheless is kept";
}

TEST_F(SchedulerTest, LateResultAfterExpiryIsStaleAndKept) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto late = LeaseOne(kFirst);
  Advance(12s);
  EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {late})), LeaseVerdict::kUnknownLease);
  EXPECT_EQ(StatusOf(Finish(kFirst, late)), ResultStatus::kStale) << "queued again";
  Hello(kSecond);
  const auto current = LeaseOne(kSecond);
  EXPECT_EQ(StatusOf(Finish(kFirst, late)), ResultStatus::kStale) << "leased again";
  EXPECT_EQ(StatusOf(Finish(kSecond, current)), ResultStatus::kAccepted);
  EXPECT_EQ(StatusOf(Finish(kFirst, late)), ResultStatus::kStale) << "done by another";
  EXPECT_EQ(store_.num_stale(), 1);
  EXPECT_EQ(store_.accepted_result(1)->attempt, 2);
}

TEST_F(SchedulerTest, StaleResultOfAClosedAndForgottenExperimentIsStillTold) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto late = LeaseOne(kFirst);
  Advance(12s);
  Hello(kSecond);
  const auto current = LeaseOne(kSecond);
  Finish(kSecond, current);
  Advance(options_.retention + 1s);
  Advance(1s);
  EXPECT_EQ(StatusOf(Finish(kFirst, late)), ResultStatus::kStale);
  EXPECT_EQ(StatusOf(Finish(kSecond, current)), ResultStatus::kDuplicate);
  EXPECT_EQ(store_.num_stale(), 1);
}

TEST_F(SchedulerTest, LeaseThatNeverArrivedIsNotCharged) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  LeaseOne(kFirst);  // the reply is lost
  for (int i = 0; i < 12; ++i) {
    Advance(1s);
    Heartbeat(kFirst, {});
  }
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  EXPECT_EQ(scheduler_->counters().attempts_returned, 1U);
  EXPECT_EQ(scheduler_->counters().attempts_failed, 0U);
}

TEST_F(SchedulerTest, SilentWorkerCostsAnAttemptPerSlotAndWhatItHeldReadyNone) {
  Submit(SampleSpec(40));
  Hello(kFirst, 2);
  const auto leased = Lease(kFirst, 10).jobs;
  ASSERT_EQ(leased.size(), 10U);
  Finish(kFirst, leased[0]);
  Finish(kFirst, leased[2]);
  Heartbeat(kFirst, leased);
  Advance(12s);
  for (const auto& lease : leased) {
    const bool done = lease.job_id == 1 || lease.job_id == 3;
    EXPECT_EQ(StateOf(lease.job_id), done ? JobState::kDone : JobState::kQueued) << lease.job_id;
    const bool charged = lease.job_id == 2 || lease.job_id == 4;
    if (!done) {
      EXPECT_EQ(store_.FindAttempt(lease.job_id, 1)->outcome,
                charged ? db::AttemptOutcome::kExpired : db::AttemptOutcome::kReturned)
          << lease.job_id;
    }
  }
  EXPECT_EQ(scheduler_->counters().attempts_failed, 2U);
  EXPECT_EQ(scheduler_->counters().attempts_returned, 6U);
}

TEST_F(SchedulerTest, LeasesThatEndOneAfterAnotherAreChargedInTheirOrder) {
  Submit(SampleSpec(40));
  Hello(kFirst);
  const auto first = LeaseOne(kFirst);
  Advance(1s);
  const auto second = LeaseOne(kFirst);
  const auto third = LeaseOne(kFirst);
  Advance(1s);
  Heartbeat(kFirst, {first});  // sent before the worker received the others
  Advance(options_.lease + options_.grace - 1s);
  EXPECT_EQ(StateOf(second.job_id), JobState::kQueued);
  EXPECT_EQ(scheduler_->counters().attempts_failed, 0U) << "the first one may still run";
  Advance(1s);
  EXPECT_EQ(StateOf(first.job_id), JobState::kQueued);
  EXPECT_EQ(store_.FindAttempt(first.job_id, 1)->outcome, db::AttemptOutcome::kExpired);
  EXPECT_EQ(store_.FindAttempt(second.job_id, 1)->outcome, db::AttemptOutcome::kReturned);
  EXPECT_EQ(store_.FindAttempt(third.job_id, 1)->outcome, db::AttemptOutcome::kReturned);
}

TEST_F(SchedulerTest, WhoIsHeardOfAgainIsChargedAgain) {
  Submit(SampleSpec(40));
  for (int life = 1; life <= 2; ++life) {
    Hello(kFirst);
    Lease(kFirst, 3);
    Advance(12s);
    EXPECT_EQ(scheduler_->counters().attempts_failed, static_cast<std::uint64_t>(life));
  }
}

TEST_F(SchedulerTest, AWorkerThatDiedWithTheServerCostsAnAttemptPerSlot) {
  Submit(SampleSpec(40));
  Hello(kFirst);
  EXPECT_EQ(Lease(kFirst, 5).jobs.size(), 5U);
  Restart();
  Advance(12s);
  EXPECT_EQ(scheduler_->counters().attempts_failed, 1U);
  EXPECT_EQ(scheduler_->counters().attempts_returned, 4U);
}

TEST_F(SchedulerTest, SilentWorkerMustSayHelloAgain) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  Advance(12s);
  EXPECT_EQ(StatusOf(Heartbeat(kFirst, {})), HeartbeatStatus::kUnknownWorker);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kUnknownWorker);
  Hello(kFirst);
  EXPECT_EQ(StatusOf(Heartbeat(kFirst, {})), HeartbeatStatus::kOk);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kLeased);
}

TEST_F(SchedulerTest, WallClockDecidesNothing) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  for (const std::int64_t jump : {86'400'000'000LL, -2 * 86'400'000'000LL, 3'600'000'000LL}) {
    now_.wall_us += jump;
    Advance(1s);
    EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {lease})), LeaseVerdict::kContinue);
  }
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
}

TEST_F(SchedulerTest, IdleSchedulerHasNoDeadline) {
  EXPECT_FALSE(scheduler_->next_deadline().has_value());
  Submit(SampleSpec(1));
  Hello(kFirst);
  EXPECT_TRUE(scheduler_->next_deadline().has_value());
  Finish(kFirst, LeaseOne(kFirst));
  Advance(options_.retention + 1s);
  EXPECT_FALSE(scheduler_->next_deadline().has_value());
}

// --- Restart ---------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, RunningLeaseSurvivesARestart) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  Heartbeat(kFirst, {lease});
  Restart();
  const auto beat = Heartbeat(kFirst, {lease});
  EXPECT_EQ(StatusOf(beat), HeartbeatStatus::kUnknownWorker) << "say hello";
  EXPECT_EQ(beat.server_instance, options_.server_instance);
  EXPECT_EQ(VerdictOf(beat), LeaseVerdict::kContinue) << "and go on";
  Hello(kSecond);
  EXPECT_EQ(LeaseOne(kSecond).job_id, 2) << "the running job is not given away";
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
  EXPECT_EQ(store_.accepted_result(1)->attempt, 1);
}

TEST_F(SchedulerTest, LeaseOfAWorkerThatDiedWithTheServerExpires) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  LeaseOne(kFirst);
  Restart();
  Advance(options_.lease * 9 / 10 - 1ms);
  EXPECT_EQ(StateOf(1), JobState::kLeased);
  Advance(200ms);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
}

// Regression found by killing the server every ten seconds: its restarts must not keep a dead worker's lease alive.
TEST_F(SchedulerTest, LeaseOfADeadWorkerExpiresThoughTheServerDiesEveryLease) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  LeaseOne(kFirst);
  for (int life = 0; life < 2; ++life) {
    Restart();
    Advance(options_.lease - 500ms);
  }
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  EXPECT_EQ(scheduler_->counters().leases_expired, 0U) << "in the life before";
}

TEST_F(SchedulerTest, QueueGoesOnWhereItStood) {
  Submit(SampleSpec(5));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst));
  Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCrashed);  // job 2 is queued again
  LeaseOne(kFirst);                                             // job 2 runs
  LeaseOne(kFirst);                                             // job 3 runs
  Restart();
  Hello(kSecond);
  EXPECT_EQ(LeaseOne(kSecond).job_id, 4);
  EXPECT_EQ(LeaseOne(kSecond).job_id, 5);
  EXPECT_EQ(StatusOf(Lease(kSecond)), LeaseStatus::kNoneNow);
}

// --- The end of work -------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, NoMoreWorkIsReportedAfterAllExperiments) {
  constexpr int kNoneNow = 1, kNoMoreWork = 4;
  Hello(kFirst);
  Hello(kSecond);
  EXPECT_EQ(Lease(kFirst).status, kNoMoreWork) << "there is none yet";
  EXPECT_GT(Lease(kFirst).retry_after_us, 0) << "those that wait ask again";
  Submit(SampleSpec(1));
  const auto lease = LeaseOne(kFirst);
  EXPECT_EQ(Lease(kSecond).status, kNoneNow) << "the job may come back";
  Finish(kFirst, lease);
  EXPECT_EQ(Lease(kSecond).status, kNoMoreWork);
}

// --- Cancellation ----------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, CancelReachesWorkersByHeartbeatAndLateResultsAreStale) {
  Submit(SampleSpec(3));
  Hello(kFirst);
  const auto done = LeaseOne(kFirst);
  Finish(kFirst, done);
  const auto running = LeaseOne(kFirst);
  const auto reply = Cancel(1);
  EXPECT_EQ(StatusOf(reply), ControlStatus::kOk);
  EXPECT_EQ(reply.num_jobs, 2);
  EXPECT_EQ(StateOf(1), JobState::kDone);
  EXPECT_EQ(StateOf(2), JobState::kCancelled);
  EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {running})), LeaseVerdict::kCancel);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoMoreWork) << "a cancelled job does not come back";
  EXPECT_EQ(StatusOf(Finish(kFirst, running)), ResultStatus::kStale) << "finished all the same";
  EXPECT_EQ(store_.num_accepted(), 1);
  EXPECT_EQ(StatusOf(Finish(kFirst, running, ReportedOutcome::kCancelled)), ResultStatus::kAccepted)
      << "the worker reports that it stopped";
  EXPECT_EQ(StatusOf(Cancel(1)), ControlStatus::kOk) << "again";
  EXPECT_EQ(Cancel(1).num_jobs, 0);
  EXPECT_EQ(StatusOf(Cancel(9)), ControlStatus::kUnknownExperiment);
}

TEST_F(SchedulerTest, CancelledStaysCancelledAfterARestart) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const auto running = LeaseOne(kFirst);
  Cancel(1);
  Restart();
  Hello(kFirst);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoMoreWork) << "nothing is left to do";
  EXPECT_EQ(VerdictOf(Heartbeat(kFirst, {running})), LeaseVerdict::kUnknownLease);
  EXPECT_EQ(StatusOf(Finish(kFirst, running)), ResultStatus::kStale);
  EXPECT_EQ(store_.num_accepted(), 0);
}

// The store records when a worker was last seen: to the minute while it is alive, exactly when it has gone.
TEST_F(SchedulerTest, LastSightingsAreStoredNowAndThen) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst));
  const auto stored = [this] { return store_.LoadOpenState().workers.at(worker_ids_[kFirst]).seen_at_us; };
  const std::int64_t joined = stored();
  int writes = 0;
  for (std::int64_t last = joined, second = 1; second <= 150; ++second) {
    Advance(std::chrono::seconds(1));
    Heartbeat(kFirst, {});
    writes += stored() != last ? 1 : 0;
    last = stored();
  }
  EXPECT_EQ(writes, 2) << "once a minute";
  const std::int64_t last_word = now_.wall_us;
  Advance(options_.lease + options_.grace);
  EXPECT_EQ(stored(), last_word) << "a lost worker was last heard of then, not when it was missed";
  Hello(kFirst);
  Advance(std::chrono::seconds(1));
  Heartbeat(kFirst, {});
  scheduler_->set_draining(true);
  Advance(std::chrono::seconds(1));
  EXPECT_EQ(stored(), now_.wall_us - 1'000'000) << "the end of the server is the last chance";
}

}  // namespace
}  // namespace legopt::server
