// Policy: builds that may finish an experiment. The build of the first leased job must finish it, even after restarts.
// Workers of other builds wait and get the reason, unless the specification or an operator allows any build.

#include <gmock/gmock.h>

#include "server/status.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using std::chrono::seconds;
using testing::AllOf;
using testing::HasSubstr;

class SchedulerBuildTest : public SchedulerTest {
 protected:
  void HelloOf(bus::EndpointId endpoint, const std::string& build_id) {
    legopt_msg::hello_request request = HelloRequest(endpoint);
    request.build_id = build_id;
    request.build = "release of " + build_id;
    request.processors = 2;
    const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
    Commit();
    EXPECT_EQ(reply.status, EnumNumber(HelloStatus::kOk)) << reply.message;
    worker_ids_[endpoint] = reply.worker_id;
  }
  std::string WaitingFor(std::int64_t id = 1) {
    return StatusJson(*scheduler_, id, now_, "").at("experiments").at(0).at("waiting_for");
  }
  static nlohmann::json SpecForAny() {
    nlohmann::json spec = SampleSpec();
    spec["builds"] = "any";
    return spec;
  }
};

TEST_F(SchedulerBuildTest, TheFirstBuildFinishesAnExperiment) {
  Submit(SampleSpec());
  EXPECT_EQ(Summary().control.build_id, "");
  HelloOf(kFirst, "old");
  HelloOf(kSecond, "new");
  const auto lease = LeaseOne(kSecond);
  EXPECT_EQ(Summary().control.build_id, "new");
  const auto refused = Lease(kFirst);
  EXPECT_EQ(refused.status, EnumNumber(LeaseStatus::kNoneNow));
  EXPECT_THAT(refused.message, AllOf(HasSubstr("experiment 1"), HasSubstr("build new"), HasSubstr("build old")));
  Finish(kSecond, lease);
  EXPECT_EQ(Lease(kFirst).jobs.size(), 0U) << "bound after the first job has ended, too";
  for (int i = 0; i < 3; ++i) Finish(kSecond, LeaseOne(kSecond));
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
}

TEST_F(SchedulerBuildTest, ARestartForgetsNothing) {
  Submit(SampleSpec());
  HelloOf(kFirst, "old");
  Finish(kFirst, LeaseOne(kFirst));
  Restart();
  HelloOf(kSecond, "new");
  EXPECT_EQ(Lease(kSecond).jobs.size(), 0U);
  HelloOf(kFirst, "old");
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
}

TEST_F(SchedulerBuildTest, EachExperimentHasABuildOfItsOwn) {
  Submit(SampleSpec(), "a");
  HelloOf(kFirst, "old");
  LeaseOne(kFirst);
  Submit(SampleSpec(), "b");
  HelloOf(kSecond, "new");
  EXPECT_EQ(LeaseOne(kSecond).experiment_id, 2);
  EXPECT_EQ(Summary(2).control.build_id, "new");
}

TEST_F(SchedulerBuildTest, AnyBuildMayWhereTheSpecificationSaysSo) {
  Submit(SpecForAny());
  HelloOf(kFirst, "old");
  HelloOf(kSecond, "new");
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
  EXPECT_EQ(Lease(kSecond).jobs.size(), 1U);
  EXPECT_EQ(Summary().control.build_id, "");
}

TEST_F(SchedulerBuildTest, APersonMayLetAnyBuildFinishIt) {
  Submit(SampleSpec());
  HelloOf(kFirst, "old");
  Finish(kFirst, LeaseOne(kFirst));
  HelloOf(kSecond, "new");
  EXPECT_EQ(Lease(kSecond).jobs.size(), 0U);
  Control(1, ControlAction::kPause);
  EXPECT_EQ(Control(1, ControlAction::kResumeAnyBuild).status, EnumNumber(ControlStatus::kOk));
  EXPECT_EQ(Lease(kSecond).jobs.size(), 1U);
  EXPECT_EQ(Control(1, ControlAction::kResumeAnyBuild).status, EnumNumber(ControlStatus::kOk)) << "so already";
  Restart();
  HelloOf(kFirst, "old");
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
}

TEST_F(SchedulerBuildTest, TheStatusSaysWhatIsWaitedFor) {
  Submit(SampleSpec());
  HelloOf(kFirst, "old");
  Finish(kFirst, LeaseOne(kFirst));
  Advance(seconds(30));  // the worker has gone
  HelloOf(kSecond, "new");
  EXPECT_THAT(WaitingFor(), AllOf(HasSubstr("no worker is of build old"), HasSubstr("of build new"),
                                  HasSubstr("legopt resume 1 --any-build")));
  HelloOf(kFirst, "old");
  EXPECT_THAT(WaitingFor(), Not(HasSubstr("build")));
}

TEST_F(SchedulerBuildTest, WhatWaitsForABuildKeepsNothingFromOthers) {
  Submit(SampleSpec(8), "a");
  HelloOf(kFirst, "old");
  Finish(kFirst, LeaseOne(kFirst));
  Advance(seconds(30));
  HelloOf(kSecond, "new");
  Submit(SampleSpec(2), "b");
  // Near the end of the leasable jobs, a worker gets at most half of them: the other experiment's jobs do not count.
  EXPECT_EQ(Lease(kSecond, 8).jobs.size(), 1U);
}

TEST_F(SchedulerBuildTest, AWrongWordInTheSpecificationIsNamed) {
  nlohmann::json spec = SampleSpec();
  spec["builds"] = "all";
  const auto reply = Submit(spec);
  EXPECT_EQ(reply.status, EnumNumber(SubmitStatus::kRefused));
  EXPECT_THAT(reply.message, AllOf(HasSubstr("builds"), HasSubstr("all"), HasSubstr("'one' nor 'any'")));
}

TEST_F(SchedulerBuildTest, TheStatusTellsBuildAndHostOfAWorker) {
  legopt_msg::hello_request request = HelloRequest(kFirst);
  request.build_id = "new";
  request.processor = "AMD EPYC";
  request.processors = 4;
  request.memory_bytes = 1 << 30;
  request.load = 0.5;
  worker_ids_[kFirst] = scheduler_->Hello(now_, kFirst, request, ops_).worker_id;
  Commit();
  const auto worker = [&] { return StatusJson(*scheduler_, 0, now_, "").at("workers").at(0); };
  EXPECT_EQ(worker().at("build_id"), "new");
  EXPECT_EQ(worker().at("processor"), "AMD EPYC");
  EXPECT_EQ(worker().at("processors"), 4);
  EXPECT_EQ(worker().at("memory_bytes"), 1 << 30);
  EXPECT_EQ(worker().at("load"), 0.5);
  legopt_msg::heartbeat_request heartbeat{};
  heartbeat.worker_id = worker_ids_[kFirst];
  heartbeat.server_instance = options_.server_instance;
  heartbeat.load = 3.25;
  scheduler_->Heartbeat(now_, kFirst, heartbeat);
  EXPECT_EQ(worker().at("load"), 3.25);
}

}  // namespace
}  // namespace legopt::server
