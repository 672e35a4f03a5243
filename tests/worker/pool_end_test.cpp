// The end of a worker: stop signals, draining, idleness, and deaths of job processes in the meantime. An unfinished
// job costs no attempt as long as it can be released. Pool with a simulated server, in virtual time.

#include <gtest/gtest.h>

#include <csignal>

#include "app/exit_codes.h"
#include "tests/worker/pool_harness.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

PoolOptions WithDrain(microseconds drain) {
  PoolOptions options;
  options.drain = drain;
  return options;
}

PoolOptions WithIdleTimeout(microseconds idle_timeout) {
  PoolOptions options;
  options.idle_timeout = idle_timeout;
  return options;
}

// Lets time pass with a server that renews every lease, has no further job and receives nothing else.
void RunRenewed(PoolHarness& harness, microseconds duration) {
  const microseconds end = harness.now + duration;
  while (harness.now < end && !harness.exit_code) {
    harness.Run(std::min<microseconds>(milliseconds(500), end - harness.now));
    if (!harness.Take<CallLease>().empty()) harness.ReplyLease({}, LeaseStatus::kNoneNow);
    const auto asked = [](const Action& action) { return std::holds_alternative<CallHeartbeat>(action); };
    if (std::any_of(harness.actions.begin(), harness.actions.end(), asked)) harness.ReplyHeartbeat();
  }
}

TEST(PoolEndTest, LeavesWhenIdleOnlyIfToldTo) {
  for (const bool exit_when_idle : {true, false}) {
    PoolOptions options;
    options.exit_when_idle = exit_when_idle;
    PoolHarness harness(options);
    harness.ChildrenReady();
    harness.ReplyHello();
    harness.ReplyLease({}, LeaseStatus::kNoneNow);
    EXPECT_FALSE(harness.exit_code) << "none now is not none";
    harness.Run(seconds(1));
    harness.ReplyLease({}, LeaseStatus::kNoMoreWork);
    EXPECT_EQ(harness.exit_code.has_value(), exit_when_idle);
    if (exit_when_idle) {
      EXPECT_EQ(*harness.exit_code, ExitCode::kOk);
    }
  }
}

TEST(PoolEndTest, FirstSignalFinishesAndDeliversWhatIsAtHand) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  const auto jobs = harness.Take<AssignJob>();
  harness.pool.Stop(harness.now);
  harness.Collect();
  EXPECT_FALSE(harness.exit_code);
  harness.FinishJob(jobs[0]);
  EXPECT_TRUE(harness.Take<CallLease>().empty()) << "takes no more";
  EXPECT_FALSE(harness.exit_code) << "not before the result is acknowledged";
  harness.ReplyResult(harness.Take<CallResult>().at(0).key);
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
}

TEST(PoolEndTest, FirstSignalGivesBackWhatHasNotBegun) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1), SampleLease(2)});
  ASSERT_EQ(harness.Take<AssignJob>().size(), 1U);
  harness.pool.Stop(harness.now);
  harness.Collect();
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].key.job_id, 2);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled));
}

TEST(PoolEndTest, WhatIsLeasedAfterTheFirstSignalIsGivenBack) {
  PoolHarness harness(WithSlots(2));
  harness.StartJobs({SampleLease(1)});
  ASSERT_EQ(harness.Take<AssignJob>().size(), 1U);
  ASSERT_EQ(harness.Take<CallLease>().size(), 1U) << "for the other slot";
  harness.pool.Stop(harness.now);
  harness.Collect();
  harness.ReplyLease({SampleLease(2)});
  EXPECT_TRUE(harness.Take<AssignJob>().empty());
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].key.job_id, 2);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled));
}

TEST(PoolEndTest, AWorkerThatLeavesWaitsASecondForWhatItAskedFor) {
  for (const bool answered : {true, false}) {
    PoolHarness harness;
    harness.ChildrenReady();
    harness.ReplyHello();
    ASSERT_EQ(harness.Take<CallLease>().size(), 1U);
    harness.pool.Stop(harness.now);
    harness.Run(milliseconds(990));
    EXPECT_FALSE(harness.exit_code);
    if (answered) {
      harness.ReplyLease({SampleLease(1)});
      harness.ReplyResult(harness.Take<CallResult>().at(0).key);
    } else {
      harness.Run(milliseconds(20));
    }
    EXPECT_EQ(harness.exit_code, ExitCode::kOk);
  }
}

TEST(PoolEndTest, SecondSignalKillsAndGivesBack) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.pool.Stop(harness.now);
  harness.pool.Stop(harness.now);
  harness.Collect();
  ASSERT_EQ(harness.Take<KillChild>().size(), 1U);
  EXPECT_FALSE(harness.exit_code);
  harness.Exit(0, {9, 0, "", 0});
  EXPECT_TRUE(harness.Take<StartChild>().empty());
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled));
  harness.ReplyResult(results[0].key);
  EXPECT_EQ(harness.exit_code, ExitCode::kInterrupted);
}

TEST(PoolEndTest, SecondSignalDoesNotWaitForASilentServer) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.pool.Stop(harness.now);
  harness.pool.Stop(harness.now);
  harness.Run(seconds(1));
  EXPECT_EQ(harness.exit_code, ExitCode::kInterrupted);
}

TEST(PoolEndTest, ThirdSignalLeavesAtOnce) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  for (int i = 0; i < 3; ++i) harness.pool.Stop(harness.now);
  harness.Collect();
  EXPECT_EQ(harness.exit_code, ExitCode::kInterrupted);
}

TEST(PoolEndTest, AnIdleWorkerStopsAtOnce) {
  PoolHarness harness;
  harness.ChildrenReady();
  harness.pool.Stop(harness.now);
  harness.Collect();
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
}

TEST(PoolEndTest, ResultsForAServerThatStaysSilentDoNotHoldTheWorkerForEver) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.FinishJob(harness.Take<AssignJob>().at(0));
  harness.pool.Stop(harness.now);
  harness.Collect();
  harness.Run(seconds(9));
  EXPECT_FALSE(harness.exit_code) << "the server may be back soon";
  harness.Run(seconds(1));
  EXPECT_EQ(harness.exit_code, ExitCode::kUnreachable) << "within 10 s of the signal";
}

// --- Draining --------------------------------------------------------------------------------------------------------

TEST(PoolDrainTest, JobsRunningAfterTheDrainAreKilledAndReleased) {
  PoolHarness harness(WithDrain(seconds(30)));
  harness.StartJobs({SampleLease(1)});
  ASSERT_EQ(harness.Take<AssignJob>().size(), 1U);
  harness.pool.Stop(harness.now);
  RunRenewed(harness, milliseconds(29'900));
  EXPECT_TRUE(harness.Take<KillChild>().empty()) << "it may still finish";
  RunRenewed(harness, milliseconds(200));
  ASSERT_EQ(harness.Take<KillChild>().size(), 1U);
  EXPECT_NE(harness.log.find("1 job(s) still running after 30.0 s: released"), std::string::npos) << harness.log;
  harness.Exit(0, {SIGKILL, 0, "", 0});
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled));
  harness.ReplyResult(results[0].key);
  EXPECT_EQ(harness.exit_code, ExitCode::kOk) << "it left as it was told to";
  EXPECT_TRUE(harness.Take<StartChild>().empty());
}

TEST(PoolDrainTest, AJobThatEndsInTimeIsDelivered) {
  PoolHarness harness(WithDrain(seconds(30)));
  harness.StartJobs({SampleLease(1)});
  const auto jobs = harness.Take<AssignJob>();
  harness.pool.Stop(harness.now);
  RunRenewed(harness, seconds(29));
  harness.FinishJob(jobs.at(0));
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kFinished));
  harness.ReplyResult(results[0].key);
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
}

TEST(PoolDrainTest, NoTimeToDrainGivesBackAtOnce) {
  PoolHarness harness(WithDrain(seconds(0)));
  harness.StartJobs({SampleLease(1)});
  harness.pool.Stop(harness.now);
  harness.Collect();
  EXPECT_EQ(harness.Take<KillChild>().size(), 1U);
}

TEST(PoolDrainTest, GivingBackToASilentServerDoesNotHoldTheWorkerForEver) {
  PoolHarness harness(WithDrain(seconds(2)));
  harness.StartJobs({SampleLease(1)});
  harness.pool.Stop(harness.now);
  harness.Run(seconds(2));
  harness.Exit(0, {SIGKILL, 0, "", 0});
  harness.Run(seconds(7));
  EXPECT_FALSE(harness.exit_code);
  harness.Run(seconds(1));
  EXPECT_EQ(harness.exit_code, ExitCode::kUnreachable);
}

TEST(PoolDrainTest, AfterTheDrainASecondSignalStillEndsItAtOnce) {
  PoolHarness harness(WithDrain(seconds(2)));
  harness.StartJobs({SampleLease(1)});
  harness.pool.Stop(harness.now);
  harness.Run(seconds(3));
  harness.pool.Stop(harness.now);
  harness.Run(seconds(1));
  EXPECT_EQ(harness.exit_code, ExitCode::kInterrupted);
}

// A worker that leaves for another reason, e.g. a changed dataset, lets its jobs finish. A first signal then gives
// them the usual drain time.
TEST(PoolDrainTest, FirstSignalStartsTheDrainOfALeavingWorker) {
  PoolHarness harness(WithDrain(seconds(5)));
  harness.StartJobs({SampleLease(1)});
  harness.ReplyLease({}, LeaseStatus::kDatasetMismatch);
  RunRenewed(harness, seconds(20));
  harness.pool.Stop(harness.now);
  RunRenewed(harness, milliseconds(4'900));
  EXPECT_TRUE(harness.Take<KillChild>().empty());
  RunRenewed(harness, milliseconds(200));
  EXPECT_EQ(harness.Take<KillChild>().size(), 1U);
  harness.Exit(0, {SIGKILL, 0, "", 0});
  harness.ReplyResult(harness.Take<CallResult>().at(0).key);
  EXPECT_EQ(harness.exit_code, ExitCode::kDatasetMismatch);
}

// --- Deaths while the worker stops -----------------------------------------------------------------------------------

TEST(PoolDrainTest, AProcessEndedFromOutsideMeanwhileIsNoCrash) {
  for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGKILL}) {
    PoolHarness harness;
    harness.StartJobs({SampleLease(1)});
    harness.pool.Stop(harness.now);
    harness.Exit(0, {signal, 0, "", 0});
    const auto results = harness.Take<CallResult>();
    ASSERT_EQ(results.size(), 1U);
    EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled)) << signal;
    harness.ReplyResult(results[0].key);
    EXPECT_EQ(harness.exit_code, ExitCode::kOk);
  }
}

TEST(PoolDrainTest, ACrashOfTheJobsOwnMeanwhileIsACrash) {
  for (const int signal : {SIGSEGV, SIGABRT}) {
    PoolHarness harness;
    harness.StartJobs({SampleLease(1)});
    harness.pool.Stop(harness.now);
    harness.Exit(0, {signal, 0, "", 0});
    EXPECT_EQ(harness.Take<CallResult>().at(0).request->outcome, static_cast<int>(ReportedOutcome::kCrashed));
  }
}

TEST(PoolDrainTest, AKillFromOutsideOfAWorkerThatStaysIsACrash) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.Exit(0, {SIGKILL, 0, "", 0});
  EXPECT_EQ(harness.Take<CallResult>().at(0).request->outcome, static_cast<int>(ReportedOutcome::kCrashed));
}

// --- Idleness --------------------------------------------------------------------------------------------------------

TEST(PoolIdleTest, LeavesWhenThereWasNoJobForSoLong) {
  PoolHarness harness(WithIdleTimeout(seconds(300)));
  harness.Run(seconds(1000));
  EXPECT_FALSE(harness.exit_code) << "loading the datasets does not count";
  harness.ChildrenReady();
  harness.ReplyHello();  // answers the hello without datasets
  harness.ReplyHello();
  RunRenewed(harness, seconds(299));
  EXPECT_FALSE(harness.exit_code);
  RunRenewed(harness, seconds(3));
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
  EXPECT_NE(harness.log.find("no job for 300.0 s: leaving"), std::string::npos) << harness.log;
}

TEST(PoolIdleTest, NoExperimentYetIsNoReasonToLeaveAtOnce) {
  PoolHarness harness(WithIdleTimeout(seconds(300)));
  harness.ChildrenReady();
  harness.ReplyHello();
  harness.ReplyLease({}, LeaseStatus::kNoMoreWork);
  RunRenewed(harness, seconds(200));
  EXPECT_FALSE(harness.exit_code);
}

TEST(PoolIdleTest, AJobStartsTheTimeAnew) {
  PoolHarness harness(WithIdleTimeout(seconds(10)));
  harness.StartJobs({SampleLease(1)});
  const auto jobs = harness.Take<AssignJob>();
  RunRenewed(harness, seconds(50));
  EXPECT_FALSE(harness.exit_code) << "a job runs";
  harness.FinishJob(jobs.at(0));
  harness.ReplyResult(harness.Take<CallResult>().at(0).key);
  RunRenewed(harness, milliseconds(9'900));
  EXPECT_FALSE(harness.exit_code);
  RunRenewed(harness, milliseconds(1'500));
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
}

TEST(PoolIdleTest, AnAbsentServerIsNoJobEither) {
  PoolHarness harness(WithIdleTimeout(seconds(20)));
  harness.ChildrenReady();
  harness.Run(seconds(19));
  EXPECT_FALSE(harness.exit_code);
  harness.Run(seconds(2));
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
}

TEST(PoolIdleTest, ResultsThatNobodyTakesAreTold) {
  PoolHarness harness(WithIdleTimeout(seconds(60)));
  harness.StartJobs({SampleLease(1)});
  harness.FinishJob(harness.Take<AssignJob>().at(0));
  harness.Run(seconds(60));
  EXPECT_FALSE(harness.exit_code) << "offered once more";
  harness.Run(seconds(16));
  EXPECT_EQ(harness.exit_code, ExitCode::kUnreachable);
  EXPECT_NE(harness.log.find("1 result(s) could not be delivered"), std::string::npos) << harness.log;
}

TEST(PoolIdleTest, WhatIsLeasedToAWorkerThatLeavesIsGivenBack) {
  PoolHarness harness(WithIdleTimeout(seconds(5)));
  harness.ChildrenReady();
  harness.ReplyHello();
  ASSERT_EQ(harness.Take<CallLease>().size(), 1U);
  harness.Run(milliseconds(4'500));
  harness.pool.OnLeaseReply(harness.now, nullptr, "no answer");
  harness.Collect();
  harness.Run(milliseconds(600));  // registers again, and is idle for too long before the answer
  ASSERT_EQ(harness.Take<CallLease>().size(), 1U);
  EXPECT_FALSE(harness.exit_code);
  harness.ReplyLease({SampleLease(1)});
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled));
  harness.ReplyResult(results[0].key);
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
}

// --- A silent server -------------------------------------------------------------------------------------------------

TEST(PoolSilenceTest, WithAKeyAnotherKeyIsNamedAsAPossibleCause) {
  for (const std::string key_file : {"", "/etc/lab.key"}) {
    PoolOptions options;
    options.key_file = key_file;
    options.wait_server = seconds(20);
    PoolHarness harness(options);
    harness.ChildrenReady();
    harness.Advance(seconds(3));
    harness.pool.OnHelloReply(harness.now, nullptr, "no answer to hello within 3000 ms");
    harness.Run(seconds(20));
    EXPECT_EQ(harness.exit_code, ExitCode::kUnreachable);
    const bool keyed = !key_file.empty();
    EXPECT_EQ(harness.log.find("another key than /etc/lab.key") != std::string::npos, keyed) << harness.log;
    EXPECT_EQ(harness.log.find("port and group, and with the key in /etc/lab.key?") != std::string::npos, keyed)
        << harness.log;
    EXPECT_EQ(harness.log.find("port and group?") != std::string::npos, !keyed) << harness.log;
  }
}

}  // namespace
}  // namespace legopt::worker
