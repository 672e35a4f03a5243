// Submission, leasing and status: the policies of the scheduler, one case per test, in virtual time.

#include "server/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <set>
#include <vector>

#include "server/status.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

// --- Submission ------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, SubmissionIsIdempotentById) {
  const auto first = Submit(SampleSpec());
  EXPECT_EQ(StatusOf(first), SubmitStatus::kCreated);
  EXPECT_EQ(first.experiment_id, 1);
  EXPECT_EQ(first.num_jobs, 4);
  for (int i = 0; i < 3; ++i) {
    const auto again = Submit(SampleSpec());
    EXPECT_EQ(StatusOf(again), SubmitStatus::kAlreadyKnown);
    EXPECT_EQ(again.experiment_id, 1);
    EXPECT_EQ(again.num_jobs, 4);
    Restart();
  }
  EXPECT_EQ(Submit(SampleSpec(), "another").experiment_id, 2);
}

TEST_F(SchedulerTest, SameIdWithOtherContentIsRefused) {
  Submit(SampleSpec(4));
  const auto other = Submit(SampleSpec(5));
  EXPECT_EQ(StatusOf(other), SubmitStatus::kRefused);
  EXPECT_NE(other.message.find("s1"), std::string::npos);
  EXPECT_EQ(scheduler_->experiments().size(), 1U);
}

TEST_F(SchedulerTest, IllegalSpecIsRefusedByName) {
  auto spec = SampleSpec();
  spec["repetitions"] = 0;
  const auto reply = Submit(spec);
  EXPECT_EQ(StatusOf(reply), SubmitStatus::kRefused);
  EXPECT_NE(reply.message.find("repetitions"), std::string::npos);
}

TEST_F(SchedulerTest, MethodHashCannotMeanTwoThings) {
  Submit(SampleSpec());
  auto forged = SampleSpec();
  forged["methods"][0]["options"]["solver"] = "other";
  const auto reply = Submit(forged, "s2");
  EXPECT_EQ(StatusOf(reply), SubmitStatus::kRefused);
  EXPECT_NE(reply.message.find("hash"), std::string::npos);
  auto renamed = SampleSpec();  // a name is not an option
  renamed["methods"][0]["name"] = renamed["methods"][0]["options"]["name"] = "mine";
  EXPECT_EQ(StatusOf(Submit(renamed, "s3")), SubmitStatus::kCreated);
}

TEST_F(SchedulerTest, TooManyOpenJobsArePushedBack) {
  options_.max_open_jobs = 6;
  Restart();
  EXPECT_EQ(StatusOf(Submit(SampleSpec(4), "a")), SubmitStatus::kCreated);
  EXPECT_EQ(StatusOf(Submit(SampleSpec(4), "b")), SubmitStatus::kRefused);
  EXPECT_EQ(StatusOf(Submit(SampleSpec(2), "c")), SubmitStatus::kCreated);
}

TEST_F(SchedulerTest, ASubmitterHasABudgetOfOpenJobs) {
  options_.max_open_jobs_per_submitter = 4;
  Restart();
  auto ada = SampleSpec(4), bob = SampleSpec(4);
  ada["submitter"] = "ada";
  bob["submitter"] = "bob";
  EXPECT_EQ(StatusOf(Submit(ada, "a")), SubmitStatus::kCreated);
  const auto refused = Submit(ada, "a2");
  EXPECT_EQ(StatusOf(refused), SubmitStatus::kRefused);
  EXPECT_NE(refused.message.find("submitter 'ada' has 4 open jobs"), std::string::npos) << refused.message;
  EXPECT_EQ(StatusOf(Submit(bob, "b")), SubmitStatus::kCreated);
}

TEST_F(SchedulerTest, ExperimentsAreCounted) {
  options_.max_experiments = 1;
  Restart();
  EXPECT_EQ(StatusOf(Submit(SampleSpec(1), "a")), SubmitStatus::kCreated);
  const auto refused = Submit(SampleSpec(1), "b");
  EXPECT_EQ(StatusOf(refused), SubmitStatus::kRefused);
  EXPECT_NE(refused.message.find("takes at most 1; delete some"), std::string::npos) << refused.message;
}

// --- Leases ----------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, LeaseContainsTheWholeJob) {
  Submit(SampleSpec());
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  EXPECT_EQ(lease.job_id, 1);
  EXPECT_EQ(lease.experiment_id, 1);
  EXPECT_EQ(lease.attempt, 1);
  EXPECT_GT(lease.token, 0);
  EXPECT_EQ(lease.lease_us, 10'000'000);
  EXPECT_EQ(lease.dataset_hash, HashOf('d'));
  EXPECT_EQ(lease.method_hash, HashOf('a'));
  EXPECT_EQ(lease.task, "posture");
  EXPECT_EQ(lease.initialization, "good");
  EXPECT_EQ(lease.problem_id, 0);
  EXPECT_EQ(lease.experiment_seed, 7);
  EXPECT_EQ(lease.wall_limit_us, 60'000'000);
  EXPECT_EQ(store_.num_attempts(1), 1);
}

TEST_F(SchedulerTest, JobsAreLeasedInOrderAndOnce) {
  Submit(SampleSpec(2), "a");
  Submit(SampleSpec(2), "b");
  Hello(kFirst);
  Hello(kSecond);
  // Experiments take turns, the older one first; the jobs of each are leased in order.
  for (const std::int64_t job : {1, 3, 2, 4}) EXPECT_EQ(LeaseOne(job % 2 == 0 ? kFirst : kSecond).job_id, job);
  const auto none = Lease(kFirst);
  EXPECT_EQ(StatusOf(none), LeaseStatus::kNoneNow);
  EXPECT_GT(none.retry_after_us, 0);
}

// Three methods, two repetitions, two initializations, ten problems: the first forty blocks of three jobs.
TEST_F(SchedulerTest, MethodsOfOneProblemStartAsABlockInRandomOrder) {
  constexpr std::int64_t kMethods = 3, kProblems = 10, kStarts = 2, kRepetitions = 2, kOfMethod = 40;
  nlohmann::json spec = SampleSpec(kProblems);
  spec["methods"] = {MethodJson("a", 'a'), MethodJson("b", 'b'), MethodJson("c", 'c')};
  spec["initializations"] = {"good", "in_collision"};
  spec["repetitions"] = kRepetitions;
  Submit(spec);
  Hello(kFirst);
  std::set<std::vector<std::int64_t>> orders;
  for (std::int64_t block = 0; block < kOfMethod; ++block) {
    const std::int64_t problem = block % kProblems, start = block / kProblems % kStarts,
                       repetition = block / kProblems / kStarts;
    std::vector<std::int64_t> order;
    for (std::int64_t i = 0; i < kMethods; ++i) {
      const std::int64_t index = LeaseOne(kFirst).job_id - 1;
      order.push_back(index / kOfMethod);
      EXPECT_EQ(index % kOfMethod, (start * kProblems + problem) * kRepetitions + repetition) << "block " << block;
    }
    orders.insert(order);
    std::sort(order.begin(), order.end());
    EXPECT_EQ(order, (std::vector<std::int64_t>{0, 1, 2})) << "block " << block;
  }
  EXPECT_EQ(orders.size(), 6U) << "every order occurs among forty";
}

TEST_F(SchedulerTest, BlocksAreTheSameAfterARestart) {
  nlohmann::json spec = SampleSpec(20);
  spec["methods"] = {MethodJson("a", 'a'), MethodJson("b", 'b'), MethodJson("c", 'c')};
  Submit(spec);
  Hello(kFirst);
  std::vector<std::int64_t> first, second;
  for (int i = 0; i < 60; ++i) first.push_back(LeaseOne(kFirst).job_id);
  EXPECT_EQ(Submit(spec, "again").experiment_id, 2);
  for (int i = 0; i < 31; ++i) second.push_back(LeaseOne(kFirst).job_id - 60);
  Restart();
  Hello(kFirst);
  for (int i = 31; i < 60; ++i) second.push_back(LeaseOne(kFirst).job_id - 60);
  EXPECT_EQ(first, second);
}

TEST_F(SchedulerTest, BatchesAreSharedNearTheEnd) {
  Submit(SampleSpec(100));
  Hello(kFirst, 1);
  Hello(kSecond, 1);
  EXPECT_EQ(Lease(kFirst, 1000).jobs.size(), 25U);  // half of the rest, over two slots
  EXPECT_EQ(Lease(kSecond, 10).jobs.size(), 10U);   // never more than requested
  std::size_t leased = 35;
  while (true) {
    const auto reply = Lease(kFirst, 1000);
    if (reply.jobs.empty()) break;
    leased += reply.jobs.size();
  }
  EXPECT_EQ(leased, 100U);
}

TEST_F(SchedulerTest, AMotionEndsABatch) {
  nlohmann::json spec = SampleSpec(3);
  spec["tasks"].push_back({{"task", "motion"}, {"problems", {0, 1, 2}}, {"waypoints", {30, 30, 30}}});
  Submit(spec);
  Hello(kFirst, 1);
  std::string tasks;
  for (auto reply = Lease(kFirst, 100); !reply.jobs.empty(); reply = Lease(kFirst, 100)) {
    for (std::size_t i = 0; i < reply.jobs.size(); ++i) {
      tasks += reply.jobs[i].task[0];
      EXPECT_TRUE(reply.jobs[i].task == "posture" || i + 1 == reply.jobs.size());
    }
  }
  EXPECT_EQ(tasks, "pppmmm");
}

TEST_F(SchedulerTest, UnknownWorkerIsToldToSayHello) {
  Submit(SampleSpec());
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kUnknownWorker);
  Hello(kFirst);
  worker_ids_[kSecond] = worker_ids_[kFirst];
  EXPECT_EQ(StatusOf(Lease(kSecond)), LeaseStatus::kUnknownWorker) << "another address under the same id";
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kLeased);
  Restart();
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kUnknownWorker) << "not yet known to this instance";
}

TEST_F(SchedulerTest, WorkerKeepsItsIdOverHelloAndRestart) {
  const std::int64_t id = Hello(kFirst).worker_id;
  EXPECT_EQ(Hello(kFirst).worker_id, id);
  Restart();
  EXPECT_EQ(Hello(kFirst).worker_id, id);
  EXPECT_NE(Hello(kSecond).worker_id, id);
}

TEST_F(SchedulerTest, OtherProtocolVersionIsRefused) {
  legopt_msg::hello_request request{};
  request.protocol_version = bus::kProtocolVersion + 1;
  const auto reply = scheduler_->Hello(now_, kFirst, request, ops_);
  EXPECT_EQ(StatusOf(reply), HelloStatus::kVersionRefused);
  EXPECT_EQ(reply.worker_id, 0);
  EXPECT_FALSE(reply.message.empty());
}

TEST_F(SchedulerTest, DrainingServerLeasesNothing) {
  Submit(SampleSpec());
  Hello(kFirst);
  scheduler_->set_draining(true);
  EXPECT_EQ(StatusOf(Lease(kFirst)), LeaseStatus::kNoMoreWork);
}

// --- Datasets --------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, SameNameWithOtherContentIsAMismatchWithBothHashes) {
  Submit(SampleSpec());
  const auto hello = Hello(kFirst, 1, 'e');
  EXPECT_EQ(StatusOf(hello), HelloStatus::kDatasetMismatch);
  EXPECT_NE(hello.message.find(HashOf('d')), std::string::npos);
  EXPECT_NE(hello.message.find(HashOf('e')), std::string::npos);
}

TEST_F(SchedulerTest, MismatchThatComesLaterIsToldAtTheNextLease) {
  EXPECT_EQ(StatusOf(Hello(kFirst, 1, 'e')), HelloStatus::kOk);
  Submit(SampleSpec());
  const auto lease = Lease(kFirst);
  EXPECT_EQ(StatusOf(lease), LeaseStatus::kDatasetMismatch);
  EXPECT_NE(lease.message.find(HashOf('d')), std::string::npos);
  EXPECT_NE(lease.message.find(HashOf('e')), std::string::npos);
}

TEST_F(SchedulerTest, WorkerForAnotherDatasetWaits) {
  Submit(SampleSpec());
  EXPECT_EQ(StatusOf(Hello(kFirst, 1, 'e', "warehouse")), HelloStatus::kOk);
  const auto lease = Lease(kFirst);
  EXPECT_EQ(StatusOf(lease), LeaseStatus::kNoneNow);
  EXPECT_NE(lease.message.find("garage"), std::string::npos);
  auto spec = SampleSpec();
  spec["dataset"] = {{"name", "warehouse"}, {"hash", HashOf('e')}};
  Submit(spec, "s2");
  EXPECT_EQ(Lease(kFirst).jobs.at(0).experiment_id, 2);
}

// --- Accounting ------------------------------------------------------------------------------------------------------

TEST_F(SchedulerTest, StatusShowsProgressOfRunningJobs) {
  nlohmann::json spec = SampleSpec(3);
  spec["tasks"][0]["task"] = "motion";
  spec["limits"]["wall_time_s"] = {{"posture", 60}, {"motion", 600}};
  Submit(spec);
  Hello(kFirst, 2);
  const auto lease = LeaseOne(kFirst);
  EXPECT_EQ(lease.wall_limit_us, 600'000'000);
  const auto silent = LeaseOne(kFirst);
  legopt_msg::heartbeat_request request{};
  request.worker_id = worker_ids_[kFirst];
  request.server_instance = options_.server_instance;
  for (const auto& held : {lease, silent}) {
    legopt_msg::lease_state& state = request.leases.emplace_back();
    state.job_id = held.job_id;
    state.attempt = held.attempt;
    state.token = held.token;
  }
  request.leases[0].progress_done = 3;
  request.leases[0].progress_total = 40;
  scheduler_->Heartbeat(now_, kFirst, request);
  const auto running = StatusJson(*scheduler_, 0, now_)["experiments"][0]["running"];
  ASSERT_EQ(running.size(), 1U) << "the other one has told nothing yet";
  EXPECT_EQ(running[0]["job"], lease.job_id);
  EXPECT_EQ(running[0]["task"], "motion");
  EXPECT_EQ(running[0]["progress_done"], 3);
  EXPECT_EQ(running[0]["progress_total"], 40);
  Finish(kFirst, lease);
  EXPECT_TRUE(StatusJson(*scheduler_, 0, now_)["experiments"][0]["running"].empty());
}

TEST_F(SchedulerTest, StatusAddsUp) {
  Submit(SampleSpec(4));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst));
  LeaseOne(kFirst);
  Submit(SampleSpec(2), "s2");
  const auto status = StatusJson(*scheduler_, 0, now_);
  const auto& jobs = status["experiments"][0]["jobs"];
  EXPECT_EQ(jobs["total"], 4);
  EXPECT_EQ(jobs["queued"], 2);
  EXPECT_EQ(jobs["leased"], 1);
  EXPECT_EQ(jobs["done"], 1);
  EXPECT_EQ(status["experiments"][0]["solved"], 1);
  EXPECT_EQ(status["experiments"].size(), 2U);
  EXPECT_EQ(status["workers"][0]["leases"], 1);
  EXPECT_EQ(status["server"]["queued"], 4);
  EXPECT_EQ(StatusJson(*scheduler_, 2, now_)["experiments"].size(), 1U);
}

/// PROTOCOL.md, section 9: keys that clients may rely on.
TEST_F(SchedulerTest, StatusHasTheDocumentedKeys) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  const legopt_msg::lease lease = LeaseOne(kFirst);
  legopt_msg::heartbeat_request request{};
  legopt_msg::lease_state& state = request.leases.emplace_back();
  state.job_id = lease.job_id;
  state.attempt = lease.attempt;
  state.token = lease.token;
  state.progress_total = 9;
  request.worker_id = 1;
  request.num_leases = 1;
  scheduler_->Heartbeat(now_, kFirst, request);
  const auto keys = [](const nlohmann::json& object) {
    std::string text;
    for (const auto& [key, value] : object.items()) text += key + " ";  // sorted
    return text;
  };
  const auto status = StatusJson(*scheduler_, 0, now_);
  EXPECT_EQ(keys(status), "experiments server workers ");
  const auto& experiment = status["experiments"].at(0);
  EXPECT_EQ(
      keys(experiment),
      "build_id builds dataset elapsed_s eta_s finished_at_us hold hold_reason id jobs methods missing name priority "
      "rule running share solved "
      "spec_hash state submitted_at_us submitter tags taken_over waiting_for worked_s ");
  const auto alone = StatusJson(*scheduler_, 1, now_)["experiments"].at(0);
  EXPECT_EQ(keys(alone["kinds"].at(0)), "initialization method queued s_per_waypoint task ");
  EXPECT_EQ(keys(experiment["jobs"]), "cancelled dead done failed leased queued total ");
  EXPECT_EQ(keys(experiment["running"].at(0)), "job progress_done progress_total task worker ");
  EXPECT_EQ(
      keys(status["workers"].at(0)),
      "build build_id datasets draining hostname id leases load memory_bytes name online pid processor processors "
      "silent_s slots solvers ");
  EXPECT_EQ(keys(status["server"]),
            "leased oldest_lease_s queued scheduler store_error workers_not_listed ");  // the server adds store_error
                                                                                        // and transport
}

}  // namespace
}  // namespace legopt::server
