// Registration, leases, prefetch, heartbeats, dataset mismatch: Pool with a simulated server, in virtual time.

#include "worker/pool.h"

#include <gtest/gtest.h>

#include "app/exit_codes.h"
#include "tests/worker/pool_harness.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST(PoolRegistrationTest, SaysHelloWhileItLoadsAndAgainWithItsDatasets) {
  PoolHarness harness(WithSlots(2));
  EXPECT_EQ(harness.Take<StartChild>().size(), 2U);
  harness.Run(seconds(1));
  const auto announcement = harness.Take<CallHello>();
  ASSERT_EQ(announcement.size(), 1U);
  EXPECT_EQ(announcement[0].request.slots, 2);
  EXPECT_TRUE(announcement[0].request.capabilities.empty());
  harness.ReplyHello();
  harness.Run(seconds(2));
  EXPECT_FALSE(harness.Take<CallHeartbeat>().empty()) << "loading, it is heard of";
  EXPECT_TRUE(harness.Take<CallLease>().empty()) << "but can do no job";

  harness.pool.OnChildReady(harness.now, 1, {{"garage", HexHash('d')}});
  harness.Collect();
  const auto hello = harness.Take<CallHello>();
  ASSERT_EQ(hello.size(), 1U);
  ASSERT_EQ(hello[0].request.capabilities.size(), 1U);
  EXPECT_EQ(hello[0].request.capabilities[0].hash, HexHash('d'));
  EXPECT_TRUE(harness.Take<CallLease>().empty()) << "before the server knows what it has";
  harness.ReplyHello();
  EXPECT_EQ(harness.Take<CallLease>().size(), 1U);
}

TEST(PoolRegistrationTest, DatasetsThatComeDuringTheFirstHelloAreSaidAfterIt) {
  PoolHarness harness;
  harness.Run(seconds(1));
  ASSERT_EQ(harness.Take<CallHello>().size(), 1U);
  harness.ChildrenReady();
  EXPECT_TRUE(harness.Take<CallHello>().empty()) << "one at a time";
  harness.ReplyHello();
  EXPECT_TRUE(harness.Take<CallLease>().empty());
  const auto hello = harness.Take<CallHello>();
  ASSERT_EQ(hello.size(), 1U);
  EXPECT_EQ(hello[0].request.capabilities.size(), 1U);
  harness.ReplyHello();
  EXPECT_EQ(harness.Take<CallLease>().size(), 1U);
}

TEST(PoolRegistrationTest, KeepsTryingAndTellsTheUserOnce) {
  PoolHarness harness;
  harness.ChildrenReady();
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(harness.Take<CallHello>().size(), 1U) << i;
    harness.Advance(seconds(1));
    harness.pool.OnHelloReply(harness.now, nullptr, "no answer");
    harness.Collect();
    harness.Run(seconds(2));
  }
  const std::string told = "no answer from a server at 239.0.0.1:7667";
  EXPECT_NE(harness.log.find(told), std::string::npos) << harness.log;
  EXPECT_EQ(harness.log.find(told), harness.log.rfind(told)) << "within 30 s, once";
  EXPECT_FALSE(harness.exit_code);
  harness.ReplyHello();
  EXPECT_NE(harness.log.find("the server answers"), std::string::npos);
  EXPECT_TRUE(harness.pool.registered());
}

TEST(PoolRegistrationTest, GivesUpAfterWaitServer) {
  PoolOptions options;
  options.wait_server = seconds(4);
  PoolHarness harness(options);
  harness.Run(seconds(30));
  EXPECT_FALSE(harness.exit_code) << "loading the datasets does not count";
  harness.ChildrenReady();
  harness.Advance(seconds(3));
  harness.pool.OnHelloReply(harness.now, nullptr, "no answer");
  harness.Run(milliseconds(999));
  EXPECT_FALSE(harness.exit_code);
  harness.Run(milliseconds(1));
  EXPECT_EQ(harness.exit_code, ExitCode::kUnreachable);
}

TEST(PoolRegistrationTest, ARefusedVersionEndsTheWorker) {
  PoolHarness harness;
  harness.ChildrenReady();
  legopt_msg::hello_reply reply{};
  reply.status = static_cast<std::int32_t>(HelloStatus::kVersionRefused);
  reply.message = "protocol version 2 is needed";
  harness.pool.OnHelloReply(harness.now, &reply, "");
  harness.Collect();
  EXPECT_EQ(harness.exit_code, ExitCode::kUsage);
  EXPECT_NE(harness.log.find("protocol version 2 is needed"), std::string::npos);
}

TEST(PoolRegistrationTest, RegistersAgainWhenTheServerHasRestartedAndKeepsItsJobs) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  ASSERT_EQ(harness.Take<AssignJob>().size(), 1U);
  harness.Run(seconds(1));
  harness.ReplyHeartbeat(LeaseVerdict::kContinue, HeartbeatStatus::kUnknownWorker, 99);
  ASSERT_EQ(harness.Take<CallHello>().size(), 1U);
  EXPECT_TRUE(harness.Take<CancelJob>().empty());
  EXPECT_TRUE(harness.Take<KillChild>().empty());
  harness.ReplyHello(8, 99);
  const auto claim = harness.Take<CallHeartbeat>();
  ASSERT_EQ(claim.size(), 1U) << "the job is claimed at once";
  EXPECT_EQ(claim[0].request.worker_id, 8);
  EXPECT_EQ(claim[0].request.server_instance, 99);
  ASSERT_EQ(claim[0].request.leases.size(), 1U);
  EXPECT_EQ(claim[0].request.leases[0].job_id, 1);
}

TEST(PoolDatasetTest, MismatchNamesBothHashesAndTheFixAndEndsWithItsCode) {
  PoolHarness harness;
  harness.ChildrenReady();
  harness.ReplyHello();
  harness.ReplyLease({}, LeaseStatus::kDatasetMismatch);
  EXPECT_EQ(harness.exit_code, ExitCode::kDatasetMismatch);
  EXPECT_NE(harness.log.find(HexHash('d')), std::string::npos) << harness.log;
  EXPECT_NE(harness.log.find(HexHash('f')), std::string::npos) << harness.log;
  EXPECT_NE(harness.log.find("--dataset"), std::string::npos) << harness.log;
}

TEST(PoolDatasetTest, AJobOfAnotherDatasetIsNeverRun) {
  PoolHarness harness;
  legopt_msg::lease lease = SampleLease(1);
  lease.dataset_hash = HexHash('f');
  harness.StartJobs({lease});
  EXPECT_TRUE(harness.Take<AssignJob>().empty());
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kRefused));
}

TEST(PoolDatasetTest, FilesThatChangeUnderWayEndTheWorker) {
  PoolHarness harness(WithSlots(2));
  harness.Take<StartChild>();
  harness.pool.OnChildReady(harness.now, 0, {{"garage", HexHash('d')}});
  harness.pool.OnChildReady(harness.now, 1, {{"garage", HexHash('f')}});
  harness.Collect();
  ASSERT_EQ(harness.Take<KillChild>().size(), 1U);
  EXPECT_EQ(harness.exit_code, ExitCode::kDatasetMismatch);
}

TEST(PoolDatasetTest, AnUnusableDatasetEndsTheWorkerWithTheChildsWords) {
  PoolHarness harness;
  harness.pool.OnChildStartFailed(harness.now, 0, "robot.urdf: link 'x' is missing");
  harness.Collect();
  EXPECT_EQ(harness.exit_code, ExitCode::kUsage);
  EXPECT_NE(harness.log.find("link 'x' is missing"), std::string::npos);
}

PoolOptions WithFetching() {
  PoolOptions options = WithSlots(2);
  options.fetch_datasets = true;
  options.unfetched = {HexHash('b')};
  return options;
}

TEST(PoolFetchTest, APoolWithoutLeasesEndsForADatasetAndSaysNoGoodbye) {
  PoolHarness harness(WithFetching());
  harness.ChildrenReady();
  const auto hellos = harness.Take<CallHello>();
  const auto& capabilities = hellos.back().request.capabilities;
  ASSERT_EQ(capabilities.size(), 3U);
  EXPECT_EQ(capabilities[1].kind, "fetch");
  EXPECT_EQ(capabilities[2].kind, "unfetched");
  EXPECT_EQ(capabilities[2].hash, HexHash('b'));
  harness.ReplyHello();
  harness.wanted_dataset = HexHash('f');
  harness.ReplyLease({});
  EXPECT_EQ(harness.exit_code, ExitCode::kOk);
  EXPECT_EQ(harness.pool.ended_to_fetch(), HexHash('f'));
  EXPECT_TRUE(harness.pool.has_loaded());
  EXPECT_TRUE(harness.Take<CallHeartbeat>().empty()) << "the worker does not leave";
}

TEST(PoolFetchTest, WhatRunsIsFinishedBeforeAndNewJobsGoFirst) {
  PoolHarness harness(WithFetching());
  harness.StartJobs({SampleLease(1)});
  harness.wanted_dataset = HexHash('f');
  harness.Run(seconds(1));
  harness.ReplyLease({});
  EXPECT_FALSE(harness.exit_code) << "a job runs";
  harness.wanted_dataset.clear();
  harness.Run(seconds(1));
  harness.ReplyLease({});
  harness.pool.Stop(harness.now);
  harness.Run(seconds(20));
  EXPECT_EQ(harness.pool.ended_to_fetch(), "");
}

TEST(PoolFetchTest, APoolThatDoesNotFetchGoesOn) {
  PoolHarness harness;
  harness.ChildrenReady();
  EXPECT_EQ(harness.Take<CallHello>().back().request.capabilities.size(), 1U);
  harness.ReplyHello();
  harness.wanted_dataset = HexHash('f');
  harness.ReplyLease({});
  EXPECT_FALSE(harness.exit_code);
}

TEST(PoolLeaseTest, AsksForOneJobPerIdleSlotAndNotAheadForLongJobs) {
  PoolHarness harness(WithSlots(3));
  harness.ChildrenReady();
  harness.ReplyHello();
  auto calls = harness.Take<CallLease>();
  ASSERT_EQ(calls.size(), 1U);
  EXPECT_EQ(calls[0].request.max_jobs, 3);
  harness.ReplyLease({SampleLease(1), SampleLease(2), SampleLease(3)});
  harness.ReplyMethod(HexHash('e'));
  const auto jobs = harness.Take<AssignJob>();
  ASSERT_EQ(jobs.size(), 3U);
  EXPECT_TRUE(harness.Take<CallLease>().empty());
  // A job of 5 s: nothing is prefetched.
  harness.Run(seconds(1));
  harness.ReplyHeartbeat();
  harness.Advance(seconds(5));
  harness.FinishJob(jobs[0]);
  calls = harness.Take<CallLease>();
  ASSERT_EQ(calls.size(), 1U);
  EXPECT_EQ(calls[0].request.max_jobs, 1);
}

TEST(PoolLeaseTest, FetchesShortJobsAhead) {
  PoolHarness harness(WithSlots(2));
  harness.StartJobs({SampleLease(1), SampleLease(2)});
  auto jobs = harness.Take<AssignJob>();
  harness.Advance(milliseconds(10));
  harness.FinishJob(jobs[0]);
  const auto calls = harness.Take<CallLease>();
  ASSERT_EQ(calls.size(), 1U);
  EXPECT_EQ(calls[0].request.max_jobs, 1 + 2 * 6) << "60 ms of work for each of two slots, and the idle one";
  std::vector<legopt_msg::lease> leases;
  for (int i = 10; i < 23; ++i) leases.push_back(SampleLease(i));
  harness.ReplyLease(leases);
  EXPECT_EQ(harness.Take<AssignJob>().size(), 1U);
  EXPECT_TRUE(harness.Take<CallLease>().empty()) << "enough at hand";
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Take<CallHeartbeat>().back().request.leases.size(), 15U)
      << "heartbeats renew what runs, what waits, and what is under way";
}

TEST(PoolLeaseTest, HoldsNoMotionReadyHoweverShortThePosturesWere) {
  PoolHarness harness(WithSlots(2));
  harness.StartJobs({SampleLease(1), SampleLease(2)});
  const auto jobs = harness.Take<AssignJob>();
  harness.Advance(milliseconds(10));
  harness.FinishJob(jobs[0]);
  ASSERT_EQ(harness.Take<CallLease>().size(), 1U);
  legopt_msg::lease motion = SampleLease(10);
  motion.task = "motion";
  harness.ReplyLease({motion});
  EXPECT_EQ(harness.Take<AssignJob>().size(), 1U);
  EXPECT_TRUE(harness.Take<CallLease>().empty()) << "both slots are busy, and nothing is fetched ahead of a motion";
  harness.FinishJob(jobs[1]);
  const auto calls = harness.Take<CallLease>();
  ASSERT_EQ(calls.size(), 1U);
  EXPECT_EQ(calls[0].request.max_jobs, 1);
}

TEST(PoolLeaseTest, HonoursRetryAfter) {
  PoolHarness harness;
  harness.ChildrenReady();
  harness.ReplyHello();
  harness.Take<CallLease>();
  harness.ReplyLease({}, LeaseStatus::kNoneNow, 300'000);
  harness.Run(milliseconds(299));
  EXPECT_TRUE(harness.Take<CallLease>().empty());
  harness.Run(milliseconds(77));
  EXPECT_EQ(harness.Take<CallLease>().size(), 1U) << "with at most a quarter of jitter";
}

TEST(PoolLeaseTest, TellsOnceWhyThereIsNothingToDo) {
  PoolHarness harness;
  harness.ChildrenReady();
  harness.ReplyHello();
  for (int i = 0; i < 3; ++i) {
    legopt_msg::lease_reply reply{};
    reply.status = static_cast<std::int32_t>(LeaseStatus::kNoneNow);
    reply.message = "jobs are there for dataset yard, which this worker does not have";
    harness.pool.OnLeaseReply(harness.now, &reply, "");
    harness.Run(seconds(1));
  }
  EXPECT_NE(harness.log.find("dataset yard"), std::string::npos);
  EXPECT_EQ(harness.log.find("dataset yard"), harness.log.rfind("dataset yard"));
}

TEST(PoolLeaseTest, AsksForEachMethodOnceAndRunsNothingWithoutIt) {
  PoolHarness harness(WithSlots(2));
  harness.ChildrenReady();
  harness.ReplyHello();
  harness.ReplyLease({SampleLease(1), SampleLease(2)});
  EXPECT_EQ(harness.Take<CallMethod>().size(), 1U);
  EXPECT_TRUE(harness.Take<AssignJob>().empty());
  harness.pool.OnMethodReply(harness.now, HexHash('e'), nullptr, "no answer");
  harness.Run(seconds(1));
  EXPECT_EQ(harness.Take<CallMethod>().size(), 1U) << "asked again";
  harness.ReplyMethod(HexHash('e'));
  EXPECT_EQ(harness.Take<AssignJob>().size(), 2U);
}

TEST(PoolLeaseTest, JobsOfAMethodThatTheServerDoesNotKnowAreErrors) {
  PoolHarness harness;
  harness.ChildrenReady();
  harness.ReplyHello();
  harness.ReplyLease({SampleLease(1)});
  harness.ReplyMethod(HexHash('e'), MethodStatus::kUnknown);
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kError));
}

// The lease is counted from the time of the request, so that a slow reply does not extend it.
TEST(PoolLeaseTest, StopsAJobBeforeItsUnrenewedLeaseCanEnd) {
  PoolHarness harness;
  harness.ChildrenReady();
  harness.ReplyHello();
  const microseconds asked = harness.now;
  harness.Advance(seconds(2));
  harness.ReplyLease({SampleLease(1)});
  harness.ReplyMethod(HexHash('e'));
  ASSERT_EQ(harness.Take<AssignJob>().size(), 1U);
  microseconds stopped(0);
  microseconds killed(0);
  while (harness.now < asked + seconds(20) && killed == microseconds(0)) {
    harness.Advance(milliseconds(10));
    if (!harness.Take<CancelJob>().empty()) stopped = harness.now;
    if (!harness.Take<KillChild>().empty()) killed = harness.now;
  }
  EXPECT_GT(stopped, asked + seconds(8));
  EXPECT_GT(killed, stopped);
  EXPECT_LE(killed, asked + milliseconds(9'100)) << "a tenth of the lease is left";
  harness.Exit(0, {9, 0, "", 0});
  const auto results = harness.Take<CallResult>();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].request->outcome, static_cast<int>(ReportedOutcome::kCancelled))
      << "given back, should the server hear it";
}

TEST(PoolLeaseTest, HeartbeatsRenewFromWhenTheyWereSent) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  for (int i = 0; i < 30; ++i) {
    harness.Run(seconds(1));
    harness.ReplyHeartbeat();
  }
  EXPECT_TRUE(harness.Take<CancelJob>().empty());
  EXPECT_EQ(harness.pool.num_leases(), 1U);
  // Now the server becomes silent.
  harness.Run(milliseconds(8'400));
  EXPECT_TRUE(harness.Take<CancelJob>().empty());
  harness.Run(milliseconds(200));
  EXPECT_EQ(harness.Take<CancelJob>().size(), 1U);
}

TEST(PoolLeaseTest, AHeartbeatReplyOfTheWrongSizeRenewsNothing) {
  PoolHarness harness;
  harness.StartJobs({SampleLease(1)});
  harness.Run(seconds(1));
  harness.Take<CallHeartbeat>();
  legopt_msg::heartbeat_reply reply{};
  reply.server_instance = 1;
  harness.pool.OnHeartbeatReply(harness.now, &reply, "");
  harness.Run(milliseconds(7'600));
  EXPECT_EQ(harness.Take<CancelJob>().size(), 1U);
}

}  // namespace
}  // namespace legopt::worker
