// What every Store promises, over both implementations.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "db/memory_store.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

enum class Kind { kSqlite, kMemory };

class StoreConformance : public testing::TestWithParam<Kind> {
 protected:
  void SetUp() override { Open(); }

  void Open() {
    if (GetParam() == Kind::kSqlite) {
      sqlite_.reset();  // the lock first
      sqlite_ = OpenSqliteStore(folder_ / "store.sqlite");
    }
  }
  // As after a restart of the server: what was applied is there, nothing else is.
  void Reopen() { Open(); }

  Store& store() { return GetParam() == Kind::kSqlite ? *sqlite_ : memory_; }
  void Apply(const std::vector<StoreOp>& ops) { store().Apply(ops); }

  void ExpectRefused(const std::vector<StoreOp>& ops) {
    try {
      store().Apply(ops);
      ADD_FAILURE() << "an illegal operation was applied";
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kConstraint) << error.what();
    }
  }

  // Experiment 1 with jobs 1 - 4 in cells 1 and 2, worker 1.
  void Prepare() { Apply({CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)}}); }

  OpenJob JobInStore(std::int64_t job_id) {
    const OpenState state = store().LoadOpenState();
    return state.open.at(0).jobs.at(static_cast<std::size_t>(job_id - state.experiments.at(0).first_job_id));
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Store> sqlite_;
  MemoryStore memory_;
};

TEST_P(StoreConformance, EmptyStoreStartsCountingAtOne) {
  const OpenState state = store().LoadOpenState();
  EXPECT_EQ(state.next_experiment_id, 1);
  EXPECT_EQ(state.next_job_id, 1);
  EXPECT_EQ(state.next_cell_id, 1);
  EXPECT_EQ(state.next_worker_id, 1);
  EXPECT_TRUE(state.experiments.empty());
}

TEST_P(StoreConformance, TellsHowLongTheSolvesOfEachCellTook) {
  Prepare();
  ResultRecord slow = SampleResult();
  slow.wall_us = 6'000'000;
  slow.num_waypoints = 3;
  ResultRecord fast = SampleResult();
  fast.wall_us = 500'000;
  Apply({LeaseJob{1, 1, 777, 1, 10}, AcceptResult{1, 1, slow, "", "", 20}, LeaseJob{2, 1, 778, 1, 20},
         AcceptResult{2, 1, fast, "", "", 30}});
  Reopen();
  const std::vector<CellTime> times = store().LoadExperiment(1)->cell_times;
  ASSERT_EQ(times.size(), 2U);
  EXPECT_EQ(times[0].wall_us, 6'500'000);
  EXPECT_EQ(times[0].waypoints, 4);
  EXPECT_EQ(times[1].wall_us, 0);
  EXPECT_EQ(times[1].waypoints, 0);
}

TEST_P(StoreConformance, TellsWhenTheLatestAttemptOfAJobRan) {
  Prepare();
  EndAttempt returned;
  returned.job_id = 1;
  returned.attempt = 1;
  returned.outcome = AttemptOutcome::kReturned;
  returned.at_us = 15;
  Apply({LeaseJob{1, 1, 777, 1, 10}, returned, LeaseJob{2, 1, 778, 1, 12}});
  EXPECT_EQ(JobInStore(1).leased_at_us, 10);
  EXPECT_EQ(JobInStore(1).ended_at_us, 15);
  EXPECT_EQ(JobInStore(2).leased_at_us, 12);
  EXPECT_EQ(JobInStore(2).ended_at_us, 0);
  EXPECT_EQ(JobInStore(3).leased_at_us, 0);
}

TEST_P(StoreConformance, ExperimentSurvivesReopening) {
  Prepare();
  Reopen();
  const OpenState state = store().LoadOpenState();
  ASSERT_EQ(state.experiments.size(), 1U);
  const ExperimentSummary& summary = state.experiments[0];
  EXPECT_EQ(summary.submission_id, "submission-1");
  EXPECT_EQ(summary.spec_hash, HashOf('c'));
  EXPECT_EQ(summary.num_jobs, 4);
  EXPECT_EQ(summary.dataset, "garage");
  EXPECT_EQ(summary.methods, std::vector<std::string>{"SQP"});
  EXPECT_EQ(summary.jobs_by_state[static_cast<int>(JobState::kQueued)], 4);
  ASSERT_EQ(state.open.size(), 1U);
  EXPECT_EQ(state.open[0].spec_json, "{}");
  EXPECT_EQ(state.open[0].jobs.size(), 4U);
  EXPECT_EQ(state.next_experiment_id, 2);
  EXPECT_EQ(state.next_job_id, 5);
  EXPECT_EQ(state.next_cell_id, 3);
  ASSERT_EQ(state.workers.size(), 1U);
  EXPECT_EQ(state.workers.at(1).endpoint, 1001);
}

TEST_P(StoreConformance, MethodOptionsAreFoundByHash) {
  Prepare();
  EXPECT_EQ(store().FindMethodOptions(HashOf('a')), R"({"solver":"sqp"})");
  EXPECT_EQ(store().FindMethodOptions(HashOf('b')), std::nullopt);
}

TEST_P(StoreConformance, MethodsDatasetsAndProblemsAreShared) {
  Prepare();
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}});
  EXPECT_EQ(store().LoadOpenState().experiments.size(), 2U);
}

TEST_P(StoreConformance, SubmissionIdMakesOneExperiment) {
  Prepare();
  NewExperiment again = SampleExperiment(2, 5, 3);
  again.submission_id = "submission-1";
  ExpectRefused({CreateExperiment{again}});
  EXPECT_EQ(store().LoadOpenState().experiments.size(), 1U);
}

TEST_P(StoreConformance, LeaseIsThereAfterReopening) {
  Prepare();
  Apply({LeaseJob{2, 1, 777, 1, 10}});
  Reopen();
  const OpenJob job = JobInStore(2);
  EXPECT_EQ(job.state, JobState::kLeased);
  EXPECT_EQ(job.attempts, 1);
  EXPECT_EQ(job.token, 777);
  EXPECT_EQ(job.worker_id, 1);
  EXPECT_EQ(job.outcome, AttemptOutcome::kRunning);
  const auto attempt = store().FindAttempt(2, 1);
  ASSERT_TRUE(attempt.has_value());
  EXPECT_EQ(attempt->token, 777);
  EXPECT_EQ(attempt->job_state, JobState::kLeased);
  EXPECT_FALSE(store().FindAttempt(2, 2).has_value());
  EXPECT_FALSE(store().FindAttempt(99, 1).has_value());
}

TEST_P(StoreConformance, LeasedJobCannotBeLeasedAgain) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}});
  ExpectRefused({LeaseJob{1, 2, 778, 1, 11}});
}

TEST_P(StoreConformance, AttemptNumbersHaveNoGaps) {
  Prepare();
  ExpectRefused({LeaseJob{1, 2, 777, 1, 10}});
}

TEST_P(StoreConformance, LeaseNeedsAKnownWorker) {
  Prepare();
  ExpectRefused({LeaseJob{1, 1, 777, 9, 10}});
}

TEST_P(StoreConformance, AcceptedResultMakesTheJobDone) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}});
  Apply({AcceptResult{1, 1, SampleResult(), "", "", 20}});
  Reopen();
  EXPECT_EQ(JobInStore(1).state, JobState::kDone);
  EXPECT_EQ(store().FindAttempt(1, 1)->outcome, AttemptOutcome::kFinished);
  EXPECT_EQ(store().LoadOpenState().experiments[0].solved, 1);
}

TEST_P(StoreConformance, OneResultPerJob) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}, AcceptResult{1, 1, SampleResult(), "", "", 20}});
  ExpectRefused({AcceptResult{1, 1, SampleResult(), "", "", 21}});
  ExpectRefused({LeaseJob{1, 2, 778, 1, 22}});
}

TEST_P(StoreConformance, ResultNeedsTheRunningAttempt) {
  Prepare();
  ExpectRefused({AcceptResult{1, 1, SampleResult(), "", "", 20}});
  Apply({LeaseJob{1, 1, 777, 1, 10}, EndAttempt{1, 1, AttemptOutcome::kExpired, JobState::kQueued, 0, "", "", 15},
         LeaseJob{1, 2, 778, 1, 16}});
  ExpectRefused({AcceptResult{1, 1, SampleResult(), "", "", 20}});
  Apply({AcceptResult{1, 2, SampleResult(), "", "", 21}});
}

TEST_P(StoreConformance, IllegalResultsAreRefused) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}});
  const auto with = [](const std::function<void(ResultRecord&)>& change) {
    ResultRecord r = SampleResult();
    change(r);
    return std::vector<StoreOp>{AcceptResult{1, 1, r, "", "", 20}};
  };
  ExpectRefused(with([](ResultRecord& r) { r.solver_status = "fine"; }));
  ExpectRefused(with([](ResultRecord& r) { r.verdict_literal = "perfect"; }));
  ExpectRefused(with([](ResultRecord& r) { r.verdict_strict = ""; }));
  ExpectRefused(with([](ResultRecord& r) { r.cost = std::nan(""); }));
  ExpectRefused(with([](ResultRecord& r) { r.wall_us = -1; }));
  ExpectRefused(with([](ResultRecord& r) { r.num_waypoints = 0; }));
  ExpectRefused(with([](ResultRecord& r) { r.waypoints.pop_back(); }));
  EXPECT_EQ(JobInStore(1).state, JobState::kLeased);
}

TEST_P(StoreConformance, FailedAttemptsRequeueAndThenKill) {
  Prepare();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    Apply({LeaseJob{1, attempt, 700 + attempt, 1, 10}});
    const JobState next = attempt < 3 ? JobState::kQueued : JobState::kDead;
    Apply({EndAttempt{1, attempt, AttemptOutcome::kCrashed, next, 11, "segmentation fault", "last line", 20}});
    EXPECT_EQ(JobInStore(1).state, next);
  }
  ExpectRefused({LeaseJob{1, 4, 800, 1, 30}});
}

TEST_P(StoreConformance, AttemptsBeyondTheMaximumAreRefused) {
  Prepare();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    Apply({LeaseJob{1, attempt, 700 + attempt, 1, 10},
           EndAttempt{1, attempt, AttemptOutcome::kCrashed, JobState::kQueued, 0, "", "", 20}});
  }
  ExpectRefused({LeaseJob{1, 4, 800, 1, 30}});
}

TEST_P(StoreConformance, ReturnedAttemptsAreNotCharged) {
  Prepare();
  for (int attempt = 1; attempt <= 5; ++attempt) {
    Apply({LeaseJob{1, attempt, 700 + attempt, 1, 10},
           EndAttempt{1, attempt, AttemptOutcome::kReturned, JobState::kQueued, 0, "", "", 20}});
  }
  EXPECT_EQ(JobInStore(1).attempts, 5);
  EXPECT_EQ(JobInStore(1).returned, 5);
  Apply({LeaseJob{1, 6, 706, 1, 10}});
}

TEST_P(StoreConformance, AttemptEndsOnce) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}, EndAttempt{1, 1, AttemptOutcome::kExpired, JobState::kQueued, 0, "", "", 15}});
  ExpectRefused({EndAttempt{1, 1, AttemptOutcome::kCrashed, JobState::kQueued, 0, "", "", 16}});
  ExpectRefused({EndAttempt{2, 1, AttemptOutcome::kCrashed, JobState::kQueued, 0, "", "", 16}});
}

TEST_P(StoreConformance, AttemptCannotEndAsFinishedWithoutResult) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}});
  ExpectRefused({EndAttempt{1, 1, AttemptOutcome::kFinished, JobState::kQueued, 0, "", "", 15}});
  ExpectRefused({EndAttempt{1, 1, AttemptOutcome::kCrashed, JobState::kDone, 0, "", "", 15}});
  ExpectRefused({EndAttempt{1, 1, AttemptOutcome::kRunning, JobState::kQueued, 0, "", "", 15}});
}

TEST_P(StoreConformance, StaleResultIsKeptOnceAndChangesNothing) {
  Prepare();
  Apply({LeaseJob{1, 1, 777, 1, 10}, EndAttempt{1, 1, AttemptOutcome::kExpired, JobState::kQueued, 0, "", "", 15}});
  const RecordStaleResult stale{1, 1, AttemptOutcome::kFinished, "lease expired", SampleResult(), "", 20};
  Apply({stale});
  Apply({stale});
  EXPECT_EQ(JobInStore(1).state, JobState::kQueued);
  EXPECT_EQ(store().LoadOpenState().experiments[0].solved, 0);
}

TEST_P(StoreConformance, StaleResultNeedsItsAttempt) {
  Prepare();
  ExpectRefused({RecordStaleResult{1, 1, AttemptOutcome::kFinished, "late", SampleResult(), "", 20}});
}

TEST_P(StoreConformance, CancelTouchesOnlyOpenJobsOfTheExperiment) {
  Prepare();
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}});
  Apply({LeaseJob{1, 1, 777, 1, 10}, AcceptResult{1, 1, SampleResult(), "", "", 20}, LeaseJob{2, 1, 778, 1, 21}});
  Apply({CancelExperiment{1, 30}});
  Reopen();
  const OpenState state = store().LoadOpenState();
  EXPECT_EQ(state.experiments[0].state, ExperimentState::kCancelled);
  EXPECT_EQ(state.experiments[0].finished_at_us, 30);
  EXPECT_EQ(state.experiments[0].jobs_by_state[static_cast<int>(JobState::kDone)], 1);
  EXPECT_EQ(state.experiments[0].jobs_by_state[static_cast<int>(JobState::kCancelled)], 3);
  EXPECT_EQ(store().FindAttempt(2, 1)->outcome, AttemptOutcome::kCancelled);
  ASSERT_EQ(state.open.size(), 1U);
  EXPECT_EQ(state.open[0].experiment_id, 2);
  ExpectRefused({CancelExperiment{1, 31}});
  ExpectRefused({LeaseJob{3, 1, 780, 1, 32}});
}

TEST_P(StoreConformance, ExperimentFinishesWhenItsJobsHave) {
  Prepare();
  ExpectRefused({FinishExperiment{1, 40}});
  for (std::int64_t job = 1; job <= 4; ++job) {
    Apply({LeaseJob{job, 1, 700 + job, 1, 10}, AcceptResult{job, 1, SampleResult(), "", "", 20}});
  }
  Apply({FinishExperiment{1, 40}});
  EXPECT_EQ(store().LoadOpenState().experiments[0].state, ExperimentState::kDone);
  EXPECT_TRUE(store().LoadOpenState().open.empty());
}

TEST_P(StoreConformance, WorkerIsUpdatedByItsId) {
  Apply({PutWorker{SampleWorker(1)}});
  WorkerRecord renamed = SampleWorker(1);
  renamed.name = "renamed";
  Apply({PutWorker{renamed}});
  EXPECT_EQ(store().LoadOpenState().workers.at(1).name, "renamed");
  WorkerRecord thief = SampleWorker(2);
  thief.endpoint = renamed.endpoint;
  ExpectRefused({PutWorker{thief}});
}

TEST_P(StoreConformance, EventsReferToExistingRows) {
  Prepare();
  Apply({RecordEvent{"job_dead", 50, 1, 1, 1, "evidence"}, RecordEvent{"server_started", 51, {}, {}, {}, ""}});
  ExpectRefused({RecordEvent{"job_dead", 50, 7, {}, {}, ""}});
  ExpectRefused({RecordEvent{"Job dead!", 50, {}, {}, {}, ""}});
}

TEST_P(StoreConformance, BatchIsAllOrNothing) {
  Prepare();
  ExpectRefused({LeaseJob{1, 1, 777, 1, 10}, AcceptResult{1, 1, SampleResult(), "", "", 20},
                 CreateExperiment{SampleExperiment(2, 5, 3)}, PutWorker{SampleWorker(2)}, CancelExperiment{1, 30},
                 LeaseJob{77, 1, 778, 1, 30}});
  const OpenState state = store().LoadOpenState();
  EXPECT_EQ(state.experiments.size(), 1U);
  EXPECT_EQ(state.experiments[0].state, ExperimentState::kActive);
  EXPECT_EQ(state.workers.size(), 1U);
  EXPECT_EQ(JobInStore(1).state, JobState::kQueued);
  EXPECT_FALSE(store().FindAttempt(1, 1).has_value());
  Apply({LeaseJob{1, 1, 779, 1, 40}});
}

TEST_P(StoreConformance, TasksOfCellAndProblemAgree) {
  NewExperiment mixed = SampleExperiment(1, 1, 1);
  mixed.problems[1].task = "motion";
  ExpectRefused({CreateExperiment{mixed}});
}

TEST_P(StoreConformance, DecisionsAboutAnExperimentAreKept) {
  Prepare();
  const ExperimentControl held{Hold::kHeld, "why", 7};
  Apply({ControlExperiment{1, held}});
  Reopen();
  EXPECT_EQ(store().LoadOpenState().experiments.at(0).control, held);
  Apply({ControlExperiment{1, {}}});
  EXPECT_EQ(store().LoadOpenState().experiments.at(0).control, ExperimentControl{});
  ExpectRefused({ControlExperiment{1, {Hold::kHeld, "", 0}}});
  ExpectRefused({ControlExperiment{1, {Hold::kPaused, "why", 0}}});
  ExpectRefused({ControlExperiment{1, {Hold::kNone, "", kMaxPriority + 1}}});
  ExpectRefused({ControlExperiment{2, {}}});
  Apply({CancelExperiment{1, 5}});
  ExpectRefused({ControlExperiment{1, {}}});
}

TEST_P(StoreConformance, RetryQueuesWhatDiedAndChargesNothing) {
  Prepare();
  ExpectRefused({RetryExperiment{1}});
  Apply({LeaseJob{1, 1, 71, 1, 1}, EndAttempt{1, 1, AttemptOutcome::kCrashed, JobState::kDead, 11, "", "", 2},
         LeaseJob{2, 1, 72, 1, 1}, EndAttempt{2, 1, AttemptOutcome::kError, JobState::kFailed, 0, "", "", 2},
         LeaseJob{3, 1, 73, 1, 1}, AcceptResult{3, 1, SampleResult(), "", "", 2}, LeaseJob{4, 1, 74, 1, 1},
         AcceptResult{4, 1, SampleResult(), "", "", 2}, FinishExperiment{1, 3}});
  EXPECT_TRUE(store().LoadOpenState().open.empty());
  const auto closed = store().LoadExperiment(1);
  ASSERT_TRUE(closed);
  EXPECT_EQ(closed->jobs.at(0).state, JobState::kDead);
  EXPECT_FALSE(store().LoadExperiment(2));
  Apply({RetryExperiment{1}});
  Reopen();
  EXPECT_EQ(store().LoadOpenState().experiments.at(0).state, ExperimentState::kActive);
  for (const std::int64_t job : {1, 2}) {
    EXPECT_EQ(JobInStore(job).state, JobState::kQueued);
    EXPECT_EQ(JobInStore(job).returned, 1);
  }
  EXPECT_EQ(JobInStore(3).state, JobState::kDone);
  Apply({LeaseJob{1, 2, 75, 1, 4}});
  EXPECT_EQ(JobInStore(1).attempts, 2);
  ExpectRefused({RetryExperiment{1}});
}

// Jobs 1 and 2 done, stopped by the clock (2 judged a success all the same), 3 done, 4 dead; closed.
void StopByTheClock(Store& store) {
  ResultRecord stopped = SampleResult();
  stopped.solver_status = "time_limit";
  ResultRecord unsolved = stopped;
  unsolved.verdict_literal = unsolved.verdict_strict = "com";
  store.Apply(std::vector<StoreOp>{
      LeaseJob{1, 1, 71, 1, 1}, AcceptResult{1, 1, unsolved, "", "", 2}, LeaseJob{2, 1, 72, 1, 1},
      AcceptResult{2, 1, stopped, "", "", 2}, LeaseJob{3, 1, 73, 1, 1}, AcceptResult{3, 1, SampleResult(), "", "", 2},
      LeaseJob{4, 1, 74, 1, 1}, EndAttempt{4, 1, AttemptOutcome::kCrashed, JobState::kDead, 11, "", "", 2},
      FinishExperiment{1, 3}});
}

TEST_P(StoreConformance, RetryOfWhatTheClockStopped) {
  Prepare();
  StopByTheClock(store());
  const auto closed = store().LoadExperiment(1);
  EXPECT_TRUE(closed->jobs.at(0).time_limited);
  EXPECT_FALSE(closed->jobs.at(0).solved);
  EXPECT_TRUE(closed->jobs.at(1).time_limited);
  EXPECT_TRUE(closed->jobs.at(1).solved);
  EXPECT_FALSE(closed->jobs.at(2).time_limited);
  EXPECT_EQ(store().LoadOpenState().experiments.at(0).solved, 2);
  Apply({RetryExperiment{1, true, 9}});
  Reopen();
  EXPECT_EQ(store().LoadOpenState().experiments.at(0).solved, 1) << "a result that is tried again counts no more";
  for (const std::int64_t job : {1, 2, 4}) {
    EXPECT_EQ(JobInStore(job).state, JobState::kQueued) << job;
    EXPECT_EQ(JobInStore(job).returned, 1) << job;
    EXPECT_FALSE(JobInStore(job).time_limited) << job;
  }
  EXPECT_EQ(JobInStore(3).state, JobState::kDone);
  ExpectRefused({RetryExperiment{1, true, 9}});
  // The next result may be stopped and tried again as the first.
  ResultRecord stopped = SampleResult();
  stopped.solver_status = "time_limit";
  Apply({LeaseJob{1, 2, 81, 1, 4}, AcceptResult{1, 2, stopped, "", "", 5}, RetryExperiment{1, true, 9},
         LeaseJob{1, 3, 82, 1, 6}, AcceptResult{1, 3, SampleResult(), "", "", 7}});
  EXPECT_EQ(JobInStore(1).attempts, 3);
  EXPECT_EQ(store().FindAttempt(1, 1)->outcome, AttemptOutcome::kFinished) << "what happened stays";
}

TEST_P(StoreConformance, RetryLeavesWhatTheClockStoppedUnlessToldTo) {
  Prepare();
  StopByTheClock(store());
  Apply({RetryExperiment{1}});
  EXPECT_EQ(JobInStore(1).state, JobState::kDone);
  EXPECT_EQ(JobInStore(4).state, JobState::kQueued);
}

TEST_P(StoreConformance, DescriptionsAreKept) {
  NewExperiment e = SampleExperiment(1, 1, 1);
  e.submitter = "ada";
  e.methods.push_back({"Adam", HashOf('b'), "{}", 0, 100, false});
  e.cells[1].method_index = 1;
  Apply({CreateExperiment{e}});
  Apply({TagExperiment{1, "paper", true}, TagExperiment{1, "paper", true}, TagExperiment{1, "old", true},
         TagExperiment{1, "old", false}, TagExperiment{1, "never", false}, RenameExperiment{1, "another"}});
  Reopen();
  const ExperimentSummary summary = store().LoadOpenState().experiments.at(0);
  EXPECT_EQ(summary.submitter, "ada");
  EXPECT_EQ(summary.tags, std::set<std::string>{"paper"});
  EXPECT_EQ(summary.name, "another");
  EXPECT_EQ(summary.dataset, "garage");
  EXPECT_EQ(summary.methods, (std::vector<std::string>{"SQP", "Adam"}));
  for (const std::string& tag : {std::string(), std::string(101, 'x'), std::string("a,b")}) {
    EXPECT_NE(FaultOfTag(tag), "") << tag;
    ExpectRefused({TagExperiment{1, tag, true}});
  }
  for (const std::string& name : {std::string(), std::string(201, 'x')}) {
    EXPECT_NE(FaultOfName(name), "");
    ExpectRefused({RenameExperiment{1, name}});
  }
  ExpectRefused({RenameExperiment{2, "x"}});
  ExpectRefused({TagExperiment{2, "x", true}});
  ExpectRefused({TagExperiment{2, "x", false}});
  Apply({TagExperiment{1, std::string(100, 'x'), true}, RenameExperiment{1, std::string(200, 'x')}});
}

TEST_P(StoreConformance, DeletedExperimentsAreGoneAndTheirNumbersWithThem) {
  Prepare();
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}, LeaseJob{5, 1, 75, 1, 1},
         AcceptResult{5, 1, SampleResult(), "", "", 2}, LeaseJob{6, 1, 76, 1, 1},
         EndAttempt{6, 1, AttemptOutcome::kExpired, JobState::kQueued, 0, "", "", 2},
         RecordStaleResult{6, 1, AttemptOutcome::kFinished, "late", SampleResult(), "", 3},
         RecordEvent{"job_dead", 4, 2, 6, 1, ""}, RecordEvent{"worker_lost", 4, {}, {}, 1, ""},
         TagExperiment{2, "paper", true}});
  ExpectRefused({DeleteExperiment{2}});
  ExpectRefused({DeleteExperiment{3}});
  Apply({CancelExperiment{2, 5}});
  // All or nothing: a later refusal brings it back.
  ExpectRefused({LeaseJob{1, 1, 71, 1, 6}, DeleteExperiment{2}, RenameExperiment{2, "gone"}});
  EXPECT_EQ(JobInStore(1).state, JobState::kQueued);
  EXPECT_EQ(store().FindAttempt(5, 1)->outcome, AttemptOutcome::kFinished);
  EXPECT_EQ(store().LoadOpenState().experiments.at(1).solved, 1);
  EXPECT_EQ(store().LoadOpenState().experiments.at(1).tags.size(), 1U);
  Apply({DeleteExperiment{2}});
  Reopen();
  const OpenState state = store().LoadOpenState();
  EXPECT_EQ(state.experiments.size(), 1U);
  EXPECT_EQ(state.next_experiment_id, 3);
  EXPECT_EQ(state.next_job_id, 9);
  EXPECT_EQ(state.next_cell_id, 5);
  EXPECT_FALSE(store().LoadExperiment(2));
  EXPECT_FALSE(store().FindAttempt(5, 1));
  ExpectRefused({DeleteExperiment{2}});
  Apply({LeaseJob{1, 1, 71, 1, 6}});
  // The same submission is a new experiment then.
  NewExperiment again = SampleExperiment(3, 9, 5);
  again.submission_id = "submission-2";
  Apply({CreateExperiment{again}});
}

INSTANTIATE_TEST_SUITE_P(Stores, StoreConformance, testing::Values(Kind::kSqlite, Kind::kMemory),
                         [](const auto& param) { return param.param == Kind::kSqlite ? "Sqlite" : "Memory"; });

}  // namespace
}  // namespace legopt::db
