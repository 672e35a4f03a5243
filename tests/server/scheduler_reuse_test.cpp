// Policy: if an identical job has finished, its result is reused when the first lease of a job is due, and the job is
// done. Only results of the experiment's build are reused (none if any build may finish it), and none if all jobs must
// be solved again. The search never loses a lease.

#include <gmock/gmock.h>

#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using testing::AnyOf;

class SchedulerReuseTest : public SchedulerTest {
 protected:
  void HelloOf(bus::EndpointId endpoint, const std::string& build_id) {
    legopt_msg::hello_request request = HelloRequest(endpoint);
    request.build_id = build_id;
    const auto reply = scheduler_->Hello(now_, endpoint, request, ops_);
    Commit();
    worker_ids_[endpoint] = reply.worker_id;
  }
  void SolveAll(bus::EndpointId endpoint) {
    for (auto reply = Lease(endpoint, 64); !reply.jobs.empty(); reply = Lease(endpoint, 64)) {
      for (const auto& lease : reply.jobs) Finish(endpoint, lease);
    }
  }
  // Returns SampleSpec with another name and one more method.
  static nlohmann::json Larger(int num_problems = 4) {
    nlohmann::json spec = SampleSpec(num_problems);
    spec["name"] = "larger";
    spec["methods"].push_back(MethodJson("Adam", 'b'));
    return spec;
  }
};

TEST_F(SchedulerReuseTest, AnOverlapIsNotSolvedAgain) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  ASSERT_EQ(Summary(1).state, db::ExperimentState::kDone);
  Submit(Larger(), "s2");
  const auto reply = Lease(kFirst, 64);
  ASSERT_EQ(reply.status, EnumNumber(LeaseStatus::kLeased));
  EXPECT_EQ(reply.jobs.at(0).job_id, 9) << "the first one of the other method";
  EXPECT_EQ(Summary(2).taken_over, 4);
  EXPECT_EQ(Summary(2).solved, 4);
  EXPECT_EQ(Summary(2).control.build_id, "one");
  for (std::int64_t job = 5; job <= 8; ++job) {
    EXPECT_EQ(StateOf(job), db::JobState::kDone);
    EXPECT_EQ(store_.taken_from(job), job - 4);
    EXPECT_EQ(store_.accepted_result(job)->result.cost, store_.accepted_result(job - 4)->result.cost);
  }
  for (const auto& lease : reply.jobs) Finish(kFirst, lease);
  SolveAll(kFirst);
  EXPECT_EQ(Summary(2).state, db::ExperimentState::kDone);
  EXPECT_EQ(store_.LoadOpenState().experiments.at(1).taken_over, 4);
  EXPECT_EQ(scheduler_->counters().results_taken_over, 4U);
}

TEST_F(SchedulerReuseTest, WhatIsKnownThroughoutEndsWithoutALease) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  nlohmann::json same = SampleSpec();
  same["name"] = "the same";
  Submit(same, "s2");
  EXPECT_EQ(Lease(kFirst).status, EnumNumber(LeaseStatus::kNoMoreWork));
  EXPECT_EQ(Summary(2).state, db::ExperimentState::kDone);
  EXPECT_EQ(Summary(2).taken_over, 4);
  EXPECT_EQ(scheduler_->num_queued(), 0);
}

TEST_F(SchedulerReuseTest, AnotherBuildSolvesForItself) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  HelloOf(kSecond, "two");
  Submit(Larger(), "s2");
  EXPECT_THAT(LeaseOne(kSecond).job_id, AnyOf(5, 9)) << "of the first block";
  EXPECT_EQ(Summary(2).control.build_id, "two");
  EXPECT_EQ(Summary(2).taken_over, 0);
  nlohmann::json any = Larger();
  any["builds"] = "any";
  Submit(any, "s3");
  Cancel(2);
  EXPECT_EQ(LeaseOne(kSecond).job_id, 17) << "jobs 13 to 16 are known of the other build";
  EXPECT_EQ(Summary(3).taken_over, 4);
}

TEST_F(SchedulerReuseTest, AWorkerThatTellsNoBuildTakesNothingOver) {
  Submit(SampleSpec());
  Hello(kFirst);
  SolveAll(kFirst);
  Submit(Larger(), "s2");
  EXPECT_THAT(LeaseOne(kFirst).job_id, AnyOf(5, 9)) << "of the first block";
  EXPECT_EQ(Summary(2).taken_over, 0);
}

TEST_F(SchedulerReuseTest, AgainIsAgain) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  nlohmann::json anew = SampleSpec();
  anew["again"] = true;
  Submit(anew, "s2");
  Restart();
  HelloOf(kFirst, "one");
  EXPECT_EQ(LeaseOne(kFirst).job_id, 5);
  EXPECT_EQ(Summary(2).taken_over, 0);
}

TEST_F(SchedulerReuseTest, OtherSeedsAndLimitsAreOtherJobs) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  int submission = 2;
  for (const char* patch : {R"({"seed": 8})", R"({"limits": {"effort_limit": 100}})",
                            R"({"limits": {"wall_time_s": 0.001}})", R"({"dataset": {"name": "garage2"}})"}) {
    nlohmann::json other = SampleSpec();
    other.merge_patch(nlohmann::json::parse(patch));
    const auto reply = Submit(other, "s" + std::to_string(submission++));
    Lease(kFirst);
    const bool same = std::string(patch).find("garage2") != std::string::npos;  // same content with another name
    EXPECT_EQ(Summary(reply.experiment_id).taken_over, same ? 4 : 0) << patch;
    Cancel(reply.experiment_id);
  }
}

TEST_F(SchedulerReuseTest, ARestartGoesOnWithTheRest) {
  Submit(SampleSpec(300));
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  Submit(Larger(300), "s2");
  const auto first = Lease(kFirst, 64);
  EXPECT_EQ(Summary(2).taken_over, 128) << "the results of 128 jobs are enough for one commit";
  ASSERT_EQ(first.jobs.size(), 64U);
  for (const auto& lease : first.jobs) EXPECT_GT(lease.job_id, 600) << "of the method without known results";
  Restart();
  EXPECT_EQ(Summary(2).taken_over, 128);
  HelloOf(kFirst, "one");
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
  EXPECT_EQ(Summary(2).taken_over, 256);
  EXPECT_EQ(Lease(kFirst).jobs.size(), 1U);
  EXPECT_EQ(Summary(2).taken_over, 300);
  EXPECT_EQ(Summary(2).jobs_by_state, store_.LoadOpenState().experiments.at(1).jobs_by_state);
}

// One problem, two initializations, 40 repetitions: jobs of both cells alternate. A batch is not shorter for that.
TEST_F(SchedulerReuseTest, ABatchMayHaveJobsOfSeveralCells) {
  nlohmann::json spec = SampleSpec(1);
  spec["initializations"] = {"good", "in_collision"};
  spec["repetitions"] = 40;
  Submit(spec);
  HelloOf(kFirst, "one");
  EXPECT_EQ(Lease(kFirst, 20).jobs.size(), 20U);
}

// A hundred methods without known results: a request searches for some of them, and grants leases all the same.
TEST_F(SchedulerReuseTest, ManyMethodsDoNotDelayALease) {
  nlohmann::json spec = SampleSpec(2);
  for (int i = 0; i < 100; ++i) spec["methods"].push_back(MethodJson("m" + std::to_string(i), 'b'));
  Submit(spec);
  HelloOf(kFirst, "one");
  EXPECT_EQ(Lease(kFirst, 8).jobs.size(), 8U);
}

TEST_F(SchedulerReuseTest, JobsThatCameBackAreLeased) {
  nlohmann::json motions = SampleSpec(2);
  Submit(motions);
  HelloOf(kFirst, "one");
  Submit(Larger(2), "s2");
  std::vector<legopt_msg::lease> leases;
  for (int i = 0; i < 4; ++i) leases.push_back(LeaseOne(kFirst));  // shared by both experiments
  for (const auto& lease : leases) {
    Finish(kFirst, lease, lease.experiment_id == 2 ? ReportedOutcome::kCancelled : ReportedOutcome::kFinished);
  }
  EXPECT_EQ(LeaseOne(kFirst).attempt, 2) << "its first lease is over";
  EXPECT_EQ(Summary(2).taken_over, 0);
}

TEST_F(SchedulerReuseTest, WhatIsBeingDeletedIsNotTaken) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  Submit(SampleSpec(2), "s2");
  legopt_msg::control_request request{};
  request.experiment_id = 1;
  request.action = EnumNumber(ControlAction::kDelete);
  scheduler_->Control(now_, request, ops_);  // not committed yet
  EXPECT_EQ(LeaseOne(kFirst).job_id, 5);
  EXPECT_EQ(Summary(2).taken_over, 0);
}

TEST_F(SchedulerReuseTest, ASubmissionThatIsNotOnDiskYetTakesOver) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  SolveAll(kFirst);
  legopt_msg::submit_request submission{};
  submission.submission_id = "s2";
  submission.spec_json = Larger().dump();
  scheduler_->Submit(now_, submission, ops_);
  EXPECT_EQ(LeaseOne(kFirst).job_id, 9);
  EXPECT_EQ(store_.taken_from(5), 1);
}

TEST_F(SchedulerReuseTest, AStoreThatCannotBeReadCostsNoLease) {
  Submit(SampleSpec());
  HelloOf(kFirst, "one");
  reads_fail_ = true;
  EXPECT_THROW(Lease(kFirst, 4), db::StoreError);
  Commit();
  EXPECT_EQ(scheduler_->num_leases(), 0);
  EXPECT_EQ(scheduler_->num_queued(), 4);
  reads_fail_ = false;
  EXPECT_EQ(LeaseOne(kFirst).job_id, 1);
}

}  // namespace
}  // namespace legopt::server
