// Retries of jobs stopped by the wall-time limit, names, tags and deletion: operator commands on experiments that are
// over, in virtual time. A result is counted once or, if retried, not at all; a deleted experiment is gone and its
// numbers are never reused.

#include <gtest/gtest.h>

#include "server/scheduler.h"
#include "tests/server/scheduler_fixture.h"

namespace legopt::server {
namespace {

using namespace std::chrono_literals;
using db::JobState;

using enum ControlAction;

class SchedulerUpkeep : public SchedulerTest {
 protected:
  void FinishStopped(const legopt_msg::lease& lease, const std::string& verdict = "com") {
    auto result = ResultFor(worker_ids_[kFirst], lease);
    result.solver_status = "time_limit";
    result.verdict_literal = result.verdict_strict = result.verdict_solid = result.verdict_physical = verdict;
    EXPECT_EQ(StatusOf(Deliver(result)), ResultStatus::kAccepted);
  }

  // Runs two jobs: the first is stopped by the wall-time limit, the second is done.
  legopt_msg::lease RunTwoJobs(const std::string& verdict = "com") {
    Submit(SampleSpec(2));
    Hello(kFirst);
    const auto stopped = LeaseOne(kFirst);
    FinishStopped(stopped, verdict);
    Finish(kFirst, LeaseOne(kFirst));
    EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
    return stopped;
  }

  void ExpectAccountsAgree() {
    for (const db::ExperimentSummary& stored : store_.LoadOpenState().experiments) {
      const db::ExperimentSummary& known = Summary(stored.experiment_id);
      for (const auto& [state, word] : kEnumNames<JobState>) {
        EXPECT_EQ(stored.jobs_by_state[state], known.jobs_by_state[state]) << word;
      }
      EXPECT_EQ(stored.rule, known.rule);
      EXPECT_EQ(stored.solved, known.solved);
      EXPECT_EQ(stored.name, known.name);
      EXPECT_EQ(stored.tags, known.tags);
      EXPECT_EQ(stored.submitter, known.submitter);
      EXPECT_EQ(stored.dataset, known.dataset);
      EXPECT_EQ(stored.methods, known.methods);
    }
    EXPECT_EQ(store_.LoadOpenState().experiments.size(), scheduler_->experiments().size());
  }
};

TEST_F(SchedulerUpkeep, TheSpecsRuleDecidesWhatIsSolved) {
  const std::pair<const char*, int> solved_by_rule[] = {{"literal", 3}, {"strict", 2}, {"solid", 1}};
  std::int64_t experiment = 0;
  Hello(kFirst);
  for (const auto& [rule, solved] : solved_by_rule) {
    nlohmann::json spec = SampleSpec(3);
    spec["name"] = rule;
    spec["rule"] = rule;
    spec["seed"] = ++experiment;  // otherwise results would be reused
    Submit(spec, rule);
    for (int i = 0; i < 3; ++i) {
      auto result = ResultFor(worker_ids_[kFirst], LeaseOne(kFirst));
      if (i >= 1) result.verdict_solid = result.verdict_physical = "containment";
      if (i == 2) result.verdict_strict = result.verdict_solid = result.verdict_physical = "self_collision";
      EXPECT_EQ(StatusOf(Deliver(result)), ResultStatus::kAccepted);
    }
    EXPECT_EQ(ToString(Summary(experiment).rule), rule);
    EXPECT_EQ(Summary(experiment).solved, solved) << rule;
  }
  ExpectAccountsAgree();
  Restart();
  ExpectAccountsAgree();
}

TEST_F(SchedulerUpkeep, WhatTheClockStoppedIsTriedAgainWhenAskedFor) {
  const auto stopped = RunTwoJobs();
  EXPECT_EQ(Control(1, kRetry).num_jobs, 0) << "it has neither failed nor died";
  EXPECT_EQ(Control(1, kRetryTimeLimits).num_jobs, 1);
  EXPECT_EQ(Control(1, kRetryTimeLimits).num_jobs, 0) << "heard twice";
  EXPECT_EQ(Summary().state, db::ExperimentState::kActive);
  EXPECT_EQ(StateOf(1), JobState::kQueued);
  EXPECT_EQ(StateOf(2), JobState::kDone) << "the other one stays";
  EXPECT_EQ(store_.num_accepted(), 1) << "the earlier result counts no more";
  EXPECT_EQ(store_.num_stale(), 1) << "but is kept";
  ExpectAccountsAgree();
  EXPECT_EQ(StatusOf(Finish(kFirst, stopped)), ResultStatus::kDuplicate) << "the earlier attempt, sent again, is known";
  const auto again = LeaseOne(kFirst);
  EXPECT_EQ(again.job_id, 1);
  EXPECT_EQ(again.attempt, 2);
  EXPECT_EQ(StatusOf(Finish(kFirst, again)), ResultStatus::kAccepted);
  EXPECT_EQ(store_.accepted_result(1)->attempt, 2);
  EXPECT_EQ(store_.num_accepted(), 2);
  EXPECT_EQ(Summary().solved, 2);
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  EXPECT_EQ(Control(1, kRetryTimeLimits).num_jobs, 0) << "nothing was stopped this time";
  ExpectAccountsAgree();
}

TEST_F(SchedulerUpkeep, ASuccessThatTheClockStoppedIsCountedOnce) {
  RunTwoJobs("success");
  EXPECT_EQ(Summary().solved, 2);
  Control(1, kRetryTimeLimits);
  EXPECT_EQ(Summary().solved, 1);
  ExpectAccountsAgree();
  Finish(kFirst, LeaseOne(kFirst));
  EXPECT_EQ(Summary().solved, 2);
  ExpectAccountsAgree();
}

TEST_F(SchedulerUpkeep, FailedAndStoppedJobsAreTriedAgainTogetherAlsoByAnotherServer) {
  Submit(SampleSpec(3));
  Hello(kFirst);
  Finish(kFirst, LeaseOne(kFirst), ReportedOutcome::kTimeLimit);  // killed at the limit
  EXPECT_EQ(StateOf(1), JobState::kDead);
  FinishStopped(LeaseOne(kFirst));
  Finish(kFirst, LeaseOne(kFirst));
  Restart();  // the experiment is no longer in memory
  EXPECT_EQ(Control(1, kRetryTimeLimits).num_jobs, 2);
  ExpectAccountsAgree();
  Restart();
  Hello(kFirst);
  for (const int job : {1, 2}) {
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(lease.job_id, job);
    EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kAccepted);
  }
  EXPECT_EQ(store_.num_accepted(), 3);
  EXPECT_EQ(Summary().state, db::ExperimentState::kDone);
  ExpectAccountsAgree();
}

TEST_F(SchedulerUpkeep, ARetriedJobHasAllItsAttemptsAgain) {
  RunTwoJobs();
  Control(1, kRetryTimeLimits);
  for (int attempt = 2; attempt <= 4; ++attempt) {
    const auto lease = LeaseOne(kFirst);
    EXPECT_EQ(lease.attempt, attempt);
    Finish(kFirst, lease, ReportedOutcome::kCrashed);
  }
  EXPECT_EQ(StateOf(1), JobState::kDead);
}

TEST_F(SchedulerUpkeep, WhatWasLookedIntoInVainIsForgottenAgain) {
  Submit(SampleSpec(1));
  Hello(kFirst);
  const auto lease = LeaseOne(kFirst);
  Finish(kFirst, lease);
  Advance(options_.retention + 1s);
  const auto reply = Control(1, kRetryTimeLimits);
  EXPECT_EQ(StatusOf(reply), ControlStatus::kOk);
  EXPECT_NE(reply.message.find("clock"), std::string::npos) << reply.message;
  Advance(options_.retention + 1s);
  EXPECT_EQ(StatusOf(Finish(kFirst, lease)), ResultStatus::kDuplicate);
  EXPECT_EQ(StatusOf(Control(1, kDelete)), ControlStatus::kOk);
}

TEST_F(SchedulerUpkeep, ACancelledExperimentIsNotTriedAgain) {
  Submit(SampleSpec(2));
  Hello(kFirst);
  FinishStopped(LeaseOne(kFirst));
  Cancel(1);
  EXPECT_EQ(StatusOf(Control(1, kRetryTimeLimits)), ControlStatus::kRefused);
  EXPECT_EQ(StateOf(1), JobState::kDone);
}

// --- Names and tags --------------------------------------------------------------------------------------------------

TEST_F(SchedulerUpkeep, ANameCanBeChangedAtAnyTime) {
  Submit(SampleSpec(1));
  EXPECT_EQ(StatusOf(Control(1, kRename, "night run")), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Control(1, kRename, "night run")), ControlStatus::kOk) << "again";
  EXPECT_EQ(Summary().name, "night run");
  EXPECT_EQ(StatusOf(Submit(SampleSpec(1))), SubmitStatus::kAlreadyKnown) << "it is the same submission still";
  Cancel(1);
  EXPECT_EQ(StatusOf(Control(1, kRename, std::string(201, 'x'))), ControlStatus::kRefused);
  EXPECT_EQ(StatusOf(Control(1, kRename, std::string(200, 'x'))), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Control(7, kRename, "x")), ControlStatus::kUnknownExperiment);
  ExpectAccountsAgree();
  Restart();
  EXPECT_EQ(Summary().name, std::string(200, 'x'));
}

TEST_F(SchedulerUpkeep, TagsComeAndGo) {
  Submit(SampleSpec(1));
  for (const char* tag : {"paper", "draft", "paper"})
    EXPECT_EQ(StatusOf(Control(1, kTag, tag)), ControlStatus::kOk) << tag;
  EXPECT_EQ(Summary().tags, (std::set<std::string>{"draft", "paper"}));
  for (int i = 0; i < 2; ++i) EXPECT_EQ(StatusOf(Control(1, kUntag, "draft")), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Control(1, kTag, "a,b")), ControlStatus::kRefused);
  EXPECT_EQ(StatusOf(Control(1, kTag, std::string(101, 'x'))), ControlStatus::kRefused);
  ExpectAccountsAgree();
  Restart();
  EXPECT_EQ(Summary().tags, (std::set<std::string>{"paper"}));
  for (int i = 1; i < 100; ++i) EXPECT_EQ(StatusOf(Control(1, kTag, std::to_string(i))), ControlStatus::kOk);
  EXPECT_EQ(StatusOf(Control(1, kTag, "one more")), ControlStatus::kRefused) << "a status shows them all";
  EXPECT_EQ(StatusOf(Control(1, kTag, "paper")), ControlStatus::kOk);
}

// --- Deletion --------------------------------------------------------------------------------------------------------

TEST_F(SchedulerUpkeep, OnlyFinishedExperimentsCanBeDeleted) {
  Submit(SampleSpec(2), "s1");
  const auto refused = Control(1, kDelete);
  EXPECT_EQ(StatusOf(refused), ControlStatus::kRefused);
  EXPECT_NE(refused.message.find("cancel it first"), std::string::npos);
  Cancel(1);
  const auto deleted = Control(1, kDelete);
  EXPECT_EQ(StatusOf(deleted), ControlStatus::kOk);
  EXPECT_EQ(deleted.num_jobs, 2);
  EXPECT_EQ(StatusOf(Control(1, kDelete)), ControlStatus::kOk) << "again: it is so already";
  EXPECT_EQ(StatusOf(Control(1, kRetry)), ControlStatus::kUnknownExperiment);
  EXPECT_EQ(StatusOf(Control(2, kDelete)), ControlStatus::kUnknownExperiment) << "never was";
  EXPECT_TRUE(scheduler_->experiments().empty());
  EXPECT_TRUE(store_.LoadOpenState().experiments.empty());
  EXPECT_EQ(store_.job_state(1), std::nullopt);
}

TEST_F(SchedulerUpkeep, NumbersOfTheDeletedNeverReturn) {
  RunTwoJobs();
  Control(1, kDelete);
  Restart();
  EXPECT_EQ(StatusOf(Control(1, kDelete)), ControlStatus::kOk) << "was deleted, by an earlier server";
  const auto again = Submit(SampleSpec(2));
  EXPECT_EQ(StatusOf(again), SubmitStatus::kCreated) << "the same submission makes a new experiment";
  EXPECT_EQ(again.experiment_id, 2);
  Hello(kFirst);
  EXPECT_EQ(LeaseOne(kFirst).job_id, 3);
  ExpectAccountsAgree();
}

// Tested also before the deletion is on disk, while the rows still exist.
TEST_F(SchedulerUpkeep, LateReportsOfTheDeletedAreRefused) {
  Submit(SampleSpec(2), "s1");
  Submit(SampleSpec(2), "s2");
  Hello(kFirst, 4);
  const auto lost = LeaseOne(kFirst), other = LeaseOne(kFirst);
  ASSERT_EQ(other.experiment_id, 2);
  Cancel(1);
  legopt_msg::control_request request{};
  request.experiment_id = 1;
  request.action = EnumNumber(kDelete);
  EXPECT_EQ(StatusOf(scheduler_->Control(now_, request, ops_)), ControlStatus::kOk);
  const auto late = ResultFor(worker_ids_[kFirst], lost);
  const auto reply = scheduler_->Result(now_, late, ops_);
  EXPECT_EQ(StatusOf(reply), ResultStatus::kRefused) << "sending it again is useless";
  EXPECT_NE(reply.message.find("deleted"), std::string::npos);
  Commit();
  EXPECT_EQ(StatusOf(Deliver(late)), ResultStatus::kRefused);
  EXPECT_EQ(Heartbeat(kFirst, {lost, other}).verdicts,
            (std::vector{EnumNumber(LeaseVerdict::kUnknownLease), EnumNumber(LeaseVerdict::kContinue)}))
      << "its worker stops";
  EXPECT_EQ(StatusOf(Finish(kFirst, other)), ResultStatus::kAccepted) << "the neighbours are untouched";
  Restart();
  EXPECT_EQ(StatusOf(Deliver(late)), ResultStatus::kRefused);
  EXPECT_EQ(store_.num_stale(), 0);
}

TEST_F(SchedulerUpkeep, ADeletionMayBeFollowedByTheSameSubmissionAtOnce) {
  Submit(SampleSpec(2), "s1");
  Cancel(1);
  legopt_msg::control_request request{};
  request.experiment_id = 1;
  request.action = EnumNumber(kDelete);
  legopt_msg::submit_request submit{};
  submit.submission_id = "s1";
  submit.spec_json = SampleSpec(2).dump();
  EXPECT_EQ(StatusOf(scheduler_->Control(now_, request, ops_)), ControlStatus::kOk);
  EXPECT_EQ(scheduler_->Submit(now_, submit, ops_).experiment_id, 2);
  Commit();
  ExpectAccountsAgree();
}

}  // namespace
}  // namespace legopt::server
