// Policy: a job is leased only to a worker with the capabilities that it needs. A missing capability or a refusal
// costs no attempt, and the status names capabilities that every worker lacks.

#include <gmock/gmock.h>

#include "server/status.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using std::chrono::seconds;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class SchedulerCapabilityTest : public SchedulerTest {
 protected:
  static constexpr bus::EndpointId kThird = 1003;

  static nlohmann::json External(char hash_digit = 'e') {
    nlohmann::json method = MethodJson("mine (external)", 'b');
    method["options"] = {{"name", "mine (external)"},
                         {"solver", "mine"},
                         {"options", {{"declaration", HashOf(hash_digit)}, {"collision", "solid"}}}};
    return method;
  }
  // Returns jobs 1 and 2 of SQP, jobs 3 and 4 of the external solver.
  static nlohmann::json MixedSpec() {
    nlohmann::json spec = SampleSpec(2);
    spec["methods"].push_back(External());
    return spec;
  }
  static nlohmann::json ExternalSpec(int num_problems = 2) {
    nlohmann::json spec = SampleSpec(num_problems);
    spec["methods"] = {External()};
    return spec;
  }
  std::string HelloWith(bus::EndpointId endpoint, const std::vector<legopt_msg::capability>& more,
                        std::int64_t memory_bytes = 0) {
    legopt_msg::hello_request request = HelloRequest(endpoint);
    request.capabilities.insert(request.capabilities.end(), more.begin(), more.end());
    request.memory_bytes = memory_bytes;
    const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
    Commit();
    worker_ids_[endpoint] = reply.worker_id;
    EXPECT_EQ(StatusOf(reply), HelloStatus::kOk);
    return reply.message;
  }
  static legopt_msg::capability Mine(char digit = 'e') { return CapabilityOf("solver", "mine", HashOf(digit)); }
  static legopt_msg::capability Solid() { return CapabilityOf("collision", "solid", ""); }

  nlohmann::json ExperimentStatus(std::int64_t id = 1) {
    return StatusJson(*scheduler_, id, now_, "").at("experiments").at(0);
  }
  std::vector<std::string> Missing(std::int64_t id = 1) { return ExperimentStatus(id).at("missing"); }
};

TEST_F(SchedulerCapabilityTest, JobsOfASolverGoToTheWorkerThatHasItAndNobodyIsCharged) {
  Submit(ExternalSpec());
  HelloWith(kFirst, {Solid()});
  HelloWith(kSecond, {Solid(), Mine('f')});
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow);
    EXPECT_EQ(StatusOf(Lease(kSecond)), LeaseStatus::kNoneNow);
  }
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has solver 'mine' (eeeeeeee); ")));
  EXPECT_EQ(ExperimentStatus().at("waiting_for"), Missing().at(0));
  HelloWith(kThird, {Solid(), Mine()});
  EXPECT_THAT(Missing(), IsEmpty());
  for (int i = 0; i < 2; ++i) {
    const auto lease = LeaseOne(kThird);
    EXPECT_EQ(lease.attempt, 1);
    Finish(kThird, lease);
  }
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  EXPECT_EQ(store_.num_attempts(1) + store_.num_attempts(2), 2);
}

TEST_F(SchedulerCapabilityTest, AWorkerIsToldWhatItLacks) {
  Submit(ExternalSpec());
  HelloWith(kFirst, {Solid()});
  EXPECT_THAT(Lease(kFirst).message,
              HasSubstr("experiment 1 needs solver 'mine' (eeeeeeee); this worker does not have"));
  EXPECT_THAT(HelloWith(kSecond, {Solid(), Mine('f')}), HasSubstr("this worker's 'mine' has other files"));
}

TEST_F(SchedulerCapabilityTest, OtherMethodsOfTheExperimentGoOn) {
  Submit(MixedSpec());
  HelloWith(kFirst, {Solid()});
  EXPECT_EQ(LeaseOne(kFirst).job_id, 1);
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has solver 'mine'"))) << "while the others move";
  EXPECT_EQ(ExperimentStatus().at("waiting_for"), "");
  EXPECT_EQ(LeaseOne(kFirst).job_id, 2);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow);
  HelloWith(kSecond, {Solid(), Mine()});
  EXPECT_EQ(LeaseOne(kSecond).job_id, 3);
}

TEST_F(SchedulerCapabilityTest, ARefusalIsNeverCharged) {
  Submit(ExternalSpec(1));
  std::vector<legopt_msg::capability> announced = {Solid(), Mine()};
  HelloWith(kFirst, announced);
  // Far more often than a job may be released.
  for (int i = 0; i < 3 * options_.max_returns_per_job; ++i) {
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(StatusOf(Finish(kFirst, lease, ReportedOutcome::kRefused)), ResultStatus::kAccepted);
    EXPECT_EQ(StatusOf(Finish(kFirst, lease, ReportedOutcome::kRefused)), ResultStatus::kDuplicate);
    EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow) << "it would refuse again";
    HelloWith(kFirst, announced);
    EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow) << "it has announced nothing new";
    announced = {Solid(), Mine(), CapabilityOf("solver", "another", HashOf(i % 2 == 0 ? '1' : '2'))};
    HelloWith(kFirst, announced);
  }
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  const auto lease = LeaseOne(kFirst);
  Finish(kFirst, lease);
  EXPECT_EQ(StateOf(1), JobState::kDone);
}

TEST_F(SchedulerCapabilityTest, ARefusalKeepsOnlyJobsOfThatMethodAway) {
  Submit(MixedSpec());
  HelloWith(kFirst, {Solid(), Mine()});
  const auto refused = LeaseOne(kFirst);
  Finish(kFirst, refused, ReportedOutcome::kRefused);
  EXPECT_NE(LeaseOne(kFirst).method_hash, refused.method_hash);
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("workers refuse its jobs: ")));
}

TEST_F(SchedulerCapabilityTest, CollisionModelAndMemoryAreMatched) {
  Submit(ExternalSpec());
  HelloWith(kFirst, {Mine()});
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has collision model 'solid'")));
  HelloWith(kFirst, {Mine(), Solid()}, 512 << 20);  // jobs may use 1024 MB
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has 1024 MB of memory")));
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow);
  HelloWith(kFirst, {Mine(), Solid()}, std::int64_t{1} << 30);
  EXPECT_EQ(LeaseOne(kFirst).job_id, 1);
}

TEST_F(SchedulerCapabilityTest, WhatIsSpreadOverTwoWorkersIsMissing) {
  Submit(ExternalSpec());
  HelloWith(kFirst, {Mine()});
  HelloWith(kSecond, {Solid()});
  EXPECT_THAT(Missing(), ElementsAre(HasSubstr("beside the rest of what its jobs need")));
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow);
  EXPECT_EQ(StatusOf(Lease(kSecond)), LeaseStatus::kNoneNow);
}

TEST_F(SchedulerCapabilityTest, AnExperimentWaitsForItsWorkerToComeBack) {
  Submit(ExternalSpec());
  HelloWith(kFirst, {Solid()});
  HelloWith(kSecond, {Solid(), Mine()});
  EXPECT_THAT(Missing(), IsEmpty());
  for (int i = 0; i < 30; ++i) {
    Advance(seconds(1));
    Heartbeat(kFirst, {});
  }
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has solver 'mine'"))) << "its worker is lost";
  Restart();
  HelloWith(kSecond, {Solid(), Mine()});
  EXPECT_EQ(LeaseOne(kSecond).attempt, 1);
}

TEST_F(SchedulerCapabilityTest, UnknownKindsAreIgnored) {
  Submit(ExternalSpec());
  HelloWith(kFirst, {Solid(), Mine(), CapabilityOf("of the future", "x", "")});
  EXPECT_EQ(LeaseOne(kFirst).job_id, 1);
}

// --- Datasets that workers fetch -------------------------------------------------------------------------------------

class FetchedDatasetsTest : public SchedulerCapabilityTest {
 protected:
  // Registers a worker that has another dataset and can fetch more.
  void HelloOfFetcher(bus::EndpointId endpoint, const std::vector<legopt_msg::capability>& more = {},
                      const std::string& name = "warehouse") {
    legopt_msg::hello_request request = HelloRequest(endpoint, 1, 'e', name);
    request.capabilities.push_back(CapabilityOf("fetch", "", ""));
    request.capabilities.insert(request.capabilities.end(), more.begin(), more.end());
    const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
    Commit();
    EXPECT_EQ(StatusOf(reply), HelloStatus::kOk) << reply.message;
    worker_ids_[endpoint] = reply.worker_id;
  }
};

TEST_F(FetchedDatasetsTest, AWorkerThatFetchesIsToldWhatJobsWaitForOnceTheServerHasIt) {
  Submit(SampleSpec());
  HelloOfFetcher(kFirst);
  EXPECT_EQ(Lease(kFirst).wanted_dataset, "");
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has dataset 'garage'")));
  scheduler_->SetDatasetOffered(HashOf('d'), true);
  EXPECT_THAT(Missing(), IsEmpty()) << "the worker can get it";
  const auto wanted = Lease(kFirst);
  EXPECT_EQ(StatusOf(wanted), LeaseStatus::kNoneNow);
  EXPECT_EQ(wanted.wanted_dataset, HashOf('d'));
  EXPECT_EQ(wanted.message, "");
  HelloOfFetcher(kFirst, {CapabilityOf("dataset", "garage", HashOf('d'))});
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
}

TEST_F(FetchedDatasetsTest, OthersAreNotToldAndAFailureIsNotTriedAgain) {
  Submit(SampleSpec());
  scheduler_->SetDatasetOffered(HashOf('d'), true);
  Hello(kFirst, 1, 'e', "warehouse");
  EXPECT_EQ(Lease(kFirst).wanted_dataset, "");
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has dataset 'garage'")));
  HelloOfFetcher(kSecond, {CapabilityOf("unfetched", "", HashOf('d'))});
  EXPECT_EQ(Lease(kSecond).wanted_dataset, "");
  EXPECT_THAT(Missing(), ElementsAre(StartsWith("no worker has dataset 'garage'")));
  HelloOfFetcher(kThird, {CapabilityOf("unfetched", "", HashOf('c'))});
  EXPECT_EQ(Lease(kThird).wanted_dataset, HashOf('d'));
  scheduler_->SetDatasetOffered(HashOf('d'), false);
  EXPECT_EQ(Lease(kThird).wanted_dataset, "");
}

TEST_F(FetchedDatasetsTest, AWorkerThatFetchesMayHaveTheNameWithOtherContent) {
  Submit(SampleSpec());
  HelloOfFetcher(kFirst, {}, "garage");
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoneNow) << "the archive may come any moment";
  scheduler_->SetDatasetOffered(HashOf('d'), true);
  EXPECT_EQ(Lease(kFirst).wanted_dataset, HashOf('d'));
}

TEST_F(FetchedDatasetsTest, PresentWorkGoesFirstAndAnUnmetNeedBesideTheDatasetIsNoReasonToFetch) {
  Submit(ExternalSpec());
  scheduler_->SetDatasetOffered(HashOf('d'), true);
  HelloOfFetcher(kFirst);
  EXPECT_EQ(Lease(kFirst).wanted_dataset, "") << "the worker lacks the solver as well";
  nlohmann::json other = SampleSpec(1);
  other["dataset"] = {{"name", "warehouse"}, {"hash", HashOf('e')}};
  Submit(SampleSpec(), "s2");
  Submit(other, "s3");
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
  EXPECT_EQ(Lease(kFirst).wanted_dataset, HashOf('d'));
}

}  // namespace
}  // namespace legopt::server
