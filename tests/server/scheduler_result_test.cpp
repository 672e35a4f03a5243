// Results and attempts: the policies of the scheduler, one case per test, in virtual time.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <csignal>

#include "server/scheduler.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

// --- Results ---------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, ResultIsAcceptedOnceAndThenADuplicate) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
  EXPECT_EQ(StateOf(1), JobState::kDone);
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kDuplicate);
  Restart();
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kDuplicate);
  EXPECT_EQ(store_.num_accepted(), 1);
  EXPECT_EQ(store_.num_stale(), 0);
}

TEST_F(SchedulerTest, ExperimentIsDoneWithItsLastJob) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst));
  EXPECT_EQ(Summary().state, db::ExperimentState::kActive);
  Finish(kFirst, LeaseOne(kFirst));
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  EXPECT_EQ(Summary().solved, 2);
  EXPECT_TRUE(store_.LoadOpenState().open.empty());
}

TEST_F(SchedulerTest, WrongTokenIsRefused) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  auto lease = LeaseOne(kFirst);
  lease.token += 1;
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kRefused);
  lease.token -= 1;
  lease.attempt = 2;
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kRefused);
  lease.job_id = 77;
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kRefused);
  EXPECT_EQ(StateOf(1), JobState::kLeased);
  EXPECT_EQ(store_.num_stale(), 0);
}

TEST_F(SchedulerTest, CostAndTimeAreDividedByTheProblemsWaypoints) {
  auto spec = SampleSpec(1);
  spec["tasks"][0]["waypoints"][0] = 12;
  Submit(spec);
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst));
  EXPECT_EQ(store_.accepted_result(1)->result.num_waypoints, 12);
}

TEST_F(SchedulerTest, IllegalResultCostsAnAttemptWithTheReason) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (int attempt = 1; attempt <= 3; ++attempt) {
    auto result = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst));
    result.cost = std::nan("");
    const auto reply = Deliver(result);
    EXPECT_EQ(StatusOf(reply), ResultStatus::kRefused);
    EXPECT_NE(reply.message.find("cost"), std::string::npos);
  }
  EXPECT_EQ(StateOf(1), JobState::kFailed);
}

// A result of a worker of another build.
TEST_F(SchedulerTest, UnknownWordsOfAResultAreRefusedByField) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto refusal = [this](auto field) {
    auto result = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst));
    result.*field = "fine";
    const auto reply = Deliver(result);
    EXPECT_EQ(StatusOf(reply), ResultStatus::kRefused);
    return reply.message;
  };
  const std::string illegal = "the worker sent an illegal result: ";
  EXPECT_EQ(refusal(&legopt_msg::result_request::solver_status), illegal + "solver_status 'fine' is unknown");
  EXPECT_EQ(refusal(&legopt_msg::result_request::verdict_literal), illegal + "verdict_literal 'fine' is unknown");
  EXPECT_EQ(refusal(&legopt_msg::result_request::verdict_strict), illegal + "verdict_strict 'fine' is unknown");
  EXPECT_EQ(StateOf(1), JobState::kFailed);
}

TEST_F(SchedulerTest, ALateResultWithAnUnknownWordIsRefusedAndNotKept) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  auto late = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst));
  Advance(12s);
  late.verdict_strict = "";
  const auto reply = Deliver(late);
  EXPECT_EQ(StatusOf(reply), ResultStatus::kRefused);
  EXPECT_EQ(reply.message, "the worker sent an illegal result: verdict_strict '' is unknown");
  EXPECT_EQ(store_.num_stale(), 0);
  EXPECT_EQ(scheduler_->counters().results_refused, 1U);
  late.verdict_strict = late.verdict_solid = late.verdict_physical = "com";
  EXPECT_EQ(StatusOf(Deliver(late)), ResultStatus::kStale);
  EXPECT_EQ(store_.num_stale(), 1);
}

// --- Attempts --------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, CrashingJobIsDeadAfterItsAttemptsAndNeighboursAreNot) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const std::array<int, 3> signals = {SIGSEGV, SIGABRT, SIGSEGV};  // a repeated one would end it early
  for (int attempt = 1; attempt <= 3; ++attempt) {
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(lease.job_id, 1) << "a job that came back goes first";
    EXPECT_EQ(lease.attempt, attempt);
    auto crash = ResultFor(worker_ids_[kFirst], lease, ReportedOutcome::kCrashed);
    crash.exit_signal = signals.at(static_cast<std::size_t>(attempt - 1));
    EXPECT_EQ(StatusOf(Deliver(crash)), ResultStatus::kAccepted);
    EXPECT_EQ(StatusOf(Deliver(crash)), ResultStatus::kDuplicate) << "reported again";
  }
  EXPECT_EQ(StateOf(1), JobState::kDead);
  EXPECT_EQ(store_.num_attempts(1), 3);
  Finish(kFirst, LeaseOne(kFirst));
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
}

// The same signal twice is caused by the job, so a third attempt would repeat it.
TEST_F(SchedulerTest, ACrashByTheSameSignalTwiceIsNotTriedAgain) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (int attempt = 1; attempt <= 2; ++attempt) {
    EXPECT_NE(StateOf(1), JobState::kDead);
    auto crash = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst), ReportedOutcome::kCrashed);
    crash.exit_signal = SIGABRT;
    EXPECT_EQ(StatusOf(Deliver(crash)), ResultStatus::kAccepted);
  }
  EXPECT_EQ(StateOf(1), JobState::kDead);
  EXPECT_EQ(store_.num_attempts(1), 2);
}

// The kill of a process from outside is not attributed to its job.
TEST_F(SchedulerTest, KilledProcessesAreTriedAgain) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (int attempt = 1; attempt <= 2; ++attempt) {
    auto crash = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst), ReportedOutcome::kCrashed);
    crash.exit_signal = SIGKILL;
    EXPECT_EQ(StatusOf(Deliver(crash)), ResultStatus::kAccepted);
  }
  EXPECT_EQ(StateOf(1), JobState::kQueued);
}

// Regression found by the random histories: the end of the attempt is not in the store yet.
TEST_F(SchedulerTest, RepeatedCrashReportInTheRoundOfTheNextLeaseIsADuplicate) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto crash = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst), ReportedOutcome::kCrashed);
  legopt_msg::lease_request request{};
  request.worker_id = worker_ids_[kFirst];
  request.server_instance = options_.server_instance;
  request.max_jobs = 1;
  EXPECT_EQ(StatusOf(scheduler_->Result(now_, crash, ops_)), ResultStatus::kAccepted);
  EXPECT_EQ(scheduler_->Lease(now_, kFirst, request, ops_).jobs.at(0).attempt, 2);
  EXPECT_EQ(StatusOf(scheduler_->Result(now_, crash, ops_)), ResultStatus::kDuplicate);
  Commit();
  EXPECT_EQ(StateOf(1), JobState::kLeased);
  EXPECT_EQ(store_.num_attempts(1), 2);
}

TEST_F(SchedulerTest, LeasesCarryTheLimits) {
  nlohmann::json spec = SampleSpec(1);
  spec["limits"]["effort_limit"] = 4321;
  Submit(spec);
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  EXPECT_EQ(lease.effort_limit, 4321);
  EXPECT_EQ(lease.wall_limit_us, 60'000'000);
}

// The same job would reach the same limit again, so it is dead at once; an operator may retry it.
TEST_F(SchedulerTest, TimeLimitStopsAreNotRetriedAutomatically) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kTimeLimit);
  EXPECT_EQ(StateOf(1), JobState::kDead);
  EXPECT_EQ(store_.num_accepted(), 0);
  EXPECT_EQ(Control(1, ControlAction::kRetry).num_jobs, 1);
  EXPECT_EQ(StatusOf(Finish(kFirst, LeaseOne(kFirst))), ResultStatus::kAccepted);
}

TEST_F(SchedulerTest, LimitsAndErrorsCostAttempts) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCrashed);
  Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kMemoryLimit);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kError);
  EXPECT_EQ(StateOf(1), JobState::kFailed) << "the last attempt said that the job cannot run";
}

TEST_F(SchedulerTest, AttemptsSurviveARestart) {
  Submit(SampleSpec(1));
  for (int attempt = 1; attempt <= 3; ++attempt) {
    Hello(kFirst);
    Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCrashed);
    Restart();
  }
  EXPECT_EQ(StateOf(1), JobState::kDead);
}

TEST_F(SchedulerTest, JobGivenBackIsNotCharged) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  for (int i = 0; i < 5; ++i)
    EXPECT_EQ(StatusOf(Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCancelled)), ResultStatus::kAccepted);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  Finish(kFirst, LeaseOne(kFirst));
  EXPECT_EQ(StateOf(1), JobState::kDone);
}

TEST_F(SchedulerTest, GivingBackForEverIsCharged) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  int leases = 0;
  while (!db::IsTerminal(StateOf(1)) && leases < 100) {
    Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kCancelled);
    ++leases;
  }
  EXPECT_EQ(leases, options_.max_returns_per_job + 3);
}

}  // namespace
}  // namespace legopt::server
