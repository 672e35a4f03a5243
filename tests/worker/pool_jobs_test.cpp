// Job processes that end, hang, lie or are cancelled, and results in flight: Pool in virtual time.

#include <gtest/gtest.h>

#include "app/exit_codes.h"
#include "tests/worker/pool_harness.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class PoolJobTest : public testing::Test {
 protected:
  PoolJobTest() {
    harness_.StartJobs({SampleLease(1)});
    job_ = harness_.Take<AssignJob>().at(0);
  }

  // Returns the only result that is offered to the server.
  legopt_msg::result_request OnlyResult() {
    const auto results = harness_.Take<CallResult>();
    EXPECT_EQ(results.size(), 1U);
    return results.empty() ? legopt_msg::result_request{} : *results[0].request;
  }

  PoolHarness harness_;
  AssignJob job_;
};

TEST_F(PoolJobTest, AResultCarriesTheIdentityOfTheLeaseWhateverTheProcessSays) {
  legopt_msg::result_request result = ResultWithoutSolution(ReportedOutcome::kFinished, "");
  result.job_id = 555;
  result.token = 666;
  harness_.pool.OnChildResult(harness_.now, job_.slot, job_.sequence, result);
  harness_.Collect();
  const legopt_msg::result_request sent = OnlyResult();
  EXPECT_EQ(sent.worker_id, 7);
  EXPECT_EQ(sent.job_id, 1);
  EXPECT_EQ(sent.attempt, 1);
  EXPECT_EQ(sent.token, 1001);
}

TEST_F(PoolJobTest, ACrashIsReportedWithSignalAndLastWordsAndTheSlotRestartsAtOnce) {
  harness_.Exit(job_.slot, {11, 0, "assertion failed: x > 0\n", 1000});
  const legopt_msg::result_request sent = OnlyResult();
  EXPECT_EQ(sent.outcome, static_cast<int>(ReportedOutcome::kCrashed));
  EXPECT_EQ(sent.exit_signal, 11);
  EXPECT_EQ(sent.log_tail, "assertion failed: x > 0\n");
  EXPECT_NE(sent.message.find("SIGSEGV"), std::string::npos);
  EXPECT_EQ(harness_.Take<StartChild>().size(), 1U);
}

TEST_F(PoolJobTest, MemoryExhaustionIsReportedAsSuch) {
  harness_.Exit(job_.slot, {0, kChildOutOfMemory, "", 0});
  EXPECT_EQ(OnlyResult().outcome, static_cast<int>(ReportedOutcome::kMemoryLimit));
}

TEST_F(PoolJobTest, AnExitWithoutAResultIsACrash) {
  harness_.Exit(job_.slot, {0, 0, "", 0});
  const legopt_msg::result_request sent = OnlyResult();
  EXPECT_EQ(sent.outcome, static_cast<int>(ReportedOutcome::kCrashed));
  EXPECT_NE(sent.message.find("exited with code 0"), std::string::npos) << sent.message;
}

TEST_F(PoolJobTest, AHangingJobIsKilledAtItsLimitPlusOneSecond) {
  for (int i = 0; i < 60; ++i) {
    harness_.Run(seconds(1));
    harness_.ReplyHeartbeat();
  }
  EXPECT_TRUE(harness_.Take<KillChild>().empty());
  harness_.Run(seconds(1));
  ASSERT_EQ(harness_.Take<KillChild>().size(), 1U);
  harness_.Exit(job_.slot, {9, 0, "", 0});
  const legopt_msg::result_request sent = OnlyResult();
  EXPECT_EQ(sent.outcome, static_cast<int>(ReportedOutcome::kTimeLimit));
  EXPECT_NE(sent.message.find("60 s"), std::string::npos) << sent.message;
}

TEST_F(PoolJobTest, GarbageEndsTheProcessAndIsEvidence) {
  harness_.pool.OnChildGarbage(harness_.now, job_.slot, "a damaged frame");
  harness_.Collect();
  ASSERT_EQ(harness_.Take<KillChild>().size(), 1U);
  harness_.Exit(job_.slot, {9, 0, "", 0});
  const legopt_msg::result_request sent = OnlyResult();
  EXPECT_EQ(sent.outcome, static_cast<int>(ReportedOutcome::kCrashed));
  EXPECT_NE(sent.message.find("a damaged frame"), std::string::npos);
}

TEST_F(PoolJobTest, AResultForNoJobIsGarbage) {
  harness_.FinishJob(job_);
  harness_.Take<CallResult>();
  harness_.FinishJob(job_);
  EXPECT_EQ(harness_.Take<KillChild>().size(), 1U);
  EXPECT_TRUE(harness_.Take<CallResult>().empty());
}

TEST_F(PoolJobTest, ProgressTravelsWithHeartbeats) {
  harness_.pool.OnChildProgress(harness_.now, job_.slot, job_.sequence, 3, 11);
  harness_.Run(seconds(1));
  const auto beats = harness_.Take<CallHeartbeat>();
  ASSERT_EQ(beats.size(), 1U);
  EXPECT_EQ(beats[0].request.leases.at(0).progress_done, 3);
  EXPECT_EQ(beats[0].request.leases.at(0).progress_total, 11);
}

TEST_F(PoolJobTest, ACancelledJobIsStoppedAndReportedCancelled) {
  harness_.Run(seconds(1));
  harness_.ReplyHeartbeat(LeaseVerdict::kCancel);
  ASSERT_EQ(harness_.Take<CancelJob>().size(), 1U);
  harness_.FinishJob(job_);
  EXPECT_EQ(OnlyResult().outcome, static_cast<int>(ReportedOutcome::kCancelled));
  EXPECT_TRUE(harness_.Take<KillChild>().empty()) << "it stopped by itself";
}

TEST_F(PoolJobTest, ACancelledJobThatDoesNotListenIsKilledWithinASecond) {
  harness_.Run(seconds(1));
  harness_.ReplyHeartbeat(LeaseVerdict::kCancel);
  harness_.Run(seconds(1));
  ASSERT_EQ(harness_.Take<KillChild>().size(), 1U);
  harness_.Exit(job_.slot, {9, 0, "", 0});
  EXPECT_EQ(OnlyResult().outcome, static_cast<int>(ReportedOutcome::kCancelled));
}

TEST_F(PoolJobTest, AnUnknownLeaseIsStoppedAndNotReported) {
  harness_.Run(seconds(1));
  harness_.ReplyHeartbeat(LeaseVerdict::kUnknownLease);
  ASSERT_EQ(harness_.Take<CancelJob>().size(), 1U);
  harness_.FinishJob(job_);
  EXPECT_TRUE(harness_.Take<CallResult>().empty());
  EXPECT_EQ(harness_.pool.num_leases(), 0U);
  EXPECT_FALSE(harness_.Take<CallLease>().empty()) << "and goes on";
}

TEST_F(PoolJobTest, ResultsAreOfferedUntilTheServerAnswers) {
  harness_.FinishJob(job_);
  for (int i = 0; i < 20; ++i) {
    const auto calls = harness_.Take<CallResult>();
    ASSERT_EQ(calls.size(), 1U) << i;
    harness_.pool.OnResultReply(harness_.now, calls[0].key, nullptr, "no answer");
    harness_.Collect();
    harness_.Run(seconds(6));
  }
  EXPECT_EQ(harness_.pool.num_undelivered(), 1U);
  harness_.ReplyResult(harness_.Take<CallResult>().at(0).key, ResultStatus::kDuplicate);
  EXPECT_EQ(harness_.pool.num_leases(), 0U);
}

TEST_F(PoolJobTest, AResultIsDeliveredToARestartedServerUnderTheNewName) {
  harness_.Run(seconds(1));
  harness_.FinishJob(job_);
  const auto lost = harness_.Take<CallResult>();
  ASSERT_EQ(lost.size(), 1U);
  harness_.ReplyHeartbeat(LeaseVerdict::kContinue, HeartbeatStatus::kUnknownWorker, 99);
  harness_.pool.OnResultReply(harness_.now, lost[0].key, nullptr, "no answer");
  harness_.Run(seconds(6));
  EXPECT_TRUE(harness_.Take<CallResult>().empty()) << "not before it is registered";
  harness_.ReplyHello(8, 99);
  const auto again = harness_.Take<CallResult>();
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].request->worker_id, 8);
  EXPECT_EQ(again[0].request->token, 1001);
}

TEST_F(PoolJobTest, StaleAndRefusedResultsAreDroppedAndWorkGoesOn) {
  for (const ResultStatus status : {ResultStatus::kStale, ResultStatus::kRefused}) {
    PoolHarness harness;
    harness.StartJobs({SampleLease(1)});
    harness.FinishJob(harness.Take<AssignJob>().at(0));
    harness.Take<CallLease>();
    harness.ReplyResult(harness.Take<CallResult>().at(0).key, status);
    EXPECT_EQ(harness.pool.num_leases(), 0U);
    EXPECT_FALSE(harness.exit_code);
    harness.ReplyLease({SampleLease(2)});
    EXPECT_EQ(harness.Take<AssignJob>().size(), 1U);
  }
}

TEST_F(PoolJobTest, AVerdictOnAResultUnderWayDoesNotDropIt) {
  harness_.Run(seconds(1));
  harness_.FinishJob(job_);
  harness_.ReplyHeartbeat(LeaseVerdict::kUnknownLease);
  EXPECT_EQ(harness_.pool.num_undelivered(), 1U) << "its own answer decides";
}

TEST(PoolSlotTest, ACrashCostsItsNeighbourNothing) {
  PoolOptions options;
  options.slots = 2;
  PoolHarness harness(options);
  harness.StartJobs({SampleLease(1), SampleLease(2)});
  const auto jobs = harness.Take<AssignJob>();
  ASSERT_EQ(jobs.size(), 2U);
  harness.Exit(jobs[0].slot, {6, 0, "", 0});
  harness.FinishJob(jobs[1]);
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 2U);
  EXPECT_EQ(results[1].request->outcome, static_cast<int>(ReportedOutcome::kFinished));
}

TEST(PoolSlotTest, ProcessesThatNeverStartEndTheWorkerWithTheEvidence) {
  PoolHarness harness;
  for (int i = 0; i < 3; ++i) {
    ASSERT_EQ(harness.Take<StartChild>().size(), 1U);
    harness.Exit(0, {11, 0, "loading mesh 7\n", 0});
    harness.Run(seconds(2));
  }
  EXPECT_EQ(harness.exit_code, ExitCode::kInternal);
  EXPECT_NE(harness.log.find("loading mesh 7"), std::string::npos);
}

TEST(PoolSlotTest, ASlotThatFailsLaterBacksOffWhileOthersWork) {
  PoolOptions options;
  options.slots = 2;
  PoolHarness harness(options);
  harness.StartJobs({SampleLease(1), SampleLease(2)});
  const auto jobs = harness.Take<AssignJob>();
  harness.Exit(jobs[0].slot, {11, 0, "", 0});
  int starts = 0;
  for (int i = 0; i < 600; ++i) {
    harness.Advance(milliseconds(100));
    if (!harness.Take<CallHeartbeat>().empty()) {
      legopt_msg::heartbeat_reply reply{};
      reply.server_instance = 1;
      reply.verdicts.assign(harness.pool.num_leases(), 0);
      harness.pool.OnHeartbeatReply(harness.now, &reply, "");
    }
    for (const StartChild& start : harness.Take<StartChild>()) {
      ++starts;
      harness.Exit(start.slot, {11, 0, "", 0});
    }
  }
  EXPECT_GE(starts, 5);
  EXPECT_LE(starts, 12) << "in a minute";
  EXPECT_FALSE(harness.exit_code);
  EXPECT_EQ(harness.pool.num_leases(), 2U) << "the crash's result, and the neighbour's job";
}

}  // namespace
}  // namespace legopt::worker
