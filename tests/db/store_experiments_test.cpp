// Guarantees of every Store for experiments: their submission, their end, and operator commands on them.

#include "tests/db/store_conformance.h"

namespace legopt::db {
namespace {

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
  EXPECT_EQ(summary.jobs_by_state[JobState::kQueued], 4);
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

TEST_P(StoreConformance, DatasetArchivesAreFoundByHash) {
  const NewExperiment experiment = SampleExperiment(1, 1, 1);
  const std::string hash = experiment.dataset.hash;
  const std::string archive("\0packed", 7);
  EXPECT_FALSE(store().FindArchiveFacts(hash).has_experiment);
  Apply({StoreDataset{hash, archive}});
  EXPECT_EQ(store().FindDatasetArchive(hash), std::nullopt) << "no experiment has the dataset";
  Apply({CreateExperiment{experiment}});
  EXPECT_TRUE(store().FindArchiveFacts(hash).has_experiment);
  EXPECT_FALSE(store().FindArchiveFacts(hash).stored);
  Apply({StoreDataset{hash, archive}, StoreDataset{hash, "another"}});
  Reopen();
  EXPECT_EQ(store().FindDatasetArchive(hash), archive);
  EXPECT_EQ(store().FindDatasetArchive(HashOf('0')), std::nullopt);
  EXPECT_TRUE(store().FindArchiveFacts(hash).stored);
  EXPECT_EQ(store().FindArchiveFacts(HashOf('0')).stored_bytes, 7) << "the size of all archives";
  Apply({CancelExperiment{1, 2}, DeleteExperiment{1}});
  EXPECT_EQ(store().FindDatasetArchive(hash), std::nullopt);
  EXPECT_FALSE(store().FindArchiveFacts(hash).has_experiment);
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

TEST_P(StoreConformance, CancelTouchesOnlyOpenJobsOfTheExperiment) {
  Prepare();
  Apply({CreateExperiment{SampleExperiment(2, 5, 3)}});
  Apply({LeaseJob{1, 1, 777, 1, 10}, AcceptResult{1, 1, SampleResult(), "", "", 20}, LeaseJob{2, 1, 778, 1, 21}});
  Apply({CancelExperiment{1, 30}});
  Reopen();
  const OpenState state = store().LoadOpenState();
  EXPECT_EQ(state.experiments[0].state, ExperimentState::kCancelled);
  EXPECT_EQ(state.experiments[0].finished_at_us, 30);
  EXPECT_EQ(state.experiments[0].jobs_by_state[JobState::kDone], 1);
  EXPECT_EQ(state.experiments[0].jobs_by_state[JobState::kCancelled], 3);
  EXPECT_EQ(store().FindAttempt(2, 1)->outcome, AttemptOutcome::kCancelled);
  ASSERT_EQ(state.open.size(), 1U);
  EXPECT_EQ(state.open[0].experiment_id, 2);
  ExpectRefused({CancelExperiment{1, 31}});
  ExpectRefused({LeaseJob{3, 1, 780, 1, 32}});
}

// Open, ended and cancelled jobs, in cells that have all kinds, and in one without open jobs.
TEST_P(StoreConformance, JobsAreCountedByTheirStates) {
  constexpr int kProblems = 4;  // eight jobs in two cells
  Apply({CreateExperiment{SampleExperiment(1, 1, 1, kProblems)}, CreateExperiment{SampleExperiment(2, 9, 3, kProblems)},
         PutWorker{SampleWorker(1)}});
  ResultRecord unsolved = SampleResult();
  unsolved.verdict_literal = unsolved.verdict_strict = unsolved.verdict_solid = unsolved.verdict_physical =
      Verdict::kCom;
  for (const std::int64_t first : {1, 9}) {
    for (std::int64_t job = first; job < first + 5; ++job) Apply({LeaseJob{job, 1, 100 + job, 1, 10}});
    Apply({AcceptResult{first, 1, SampleResult(), "", "", 20}, AcceptResult{first + 1, 1, unsolved, "", "", 21},
           EndAttempt{first + 2, 1, AttemptOutcome::kCrashed, JobState::kDead, 6, "", "", 22},
           EndAttempt{first + 3, 1, AttemptOutcome::kError, JobState::kFailed, 0, "", "", 23}});
  }
  Apply({CancelExperiment{2, 30}});
  Reopen();
  const OpenState state = store().LoadOpenState();
  const auto expect = [&](std::size_t experiment, std::int64_t queued, std::int64_t leased, std::int64_t cancelled) {
    auto counts = state.experiments.at(experiment).jobs_by_state;
    EXPECT_EQ(counts[JobState::kQueued], queued);
    EXPECT_EQ(counts[JobState::kLeased], leased);
    EXPECT_EQ(counts[JobState::kDone], 2);
    EXPECT_EQ(counts[JobState::kDead], 1);
    EXPECT_EQ(counts[JobState::kFailed], 1);
    EXPECT_EQ(counts[JobState::kCancelled], cancelled);
    EXPECT_EQ(state.experiments.at(experiment).solved, 1);
    EXPECT_EQ(state.experiments.at(experiment).taken_over, 0);
  };
  expect(0, 3, 1, 0);
  expect(1, 0, 0, 4);
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

TEST_P(StoreConformance, TasksOfCellAndProblemAgree) {
  NewExperiment mixed = SampleExperiment(1, 1, 1);
  mixed.problems[1].task = Task::kMotion;
  ExpectRefused({CreateExperiment{mixed}});
}

TEST_P(StoreConformance, DecisionsAboutAnExperimentAreKept) {
  Prepare();
  for (const std::string reason : {"why", ""}) {
    const ExperimentControl paused{ExperimentHold::kPaused, reason, 7, BuildPolicy::kAny, "0123456789ab"};
    Apply({ControlExperiment{1, paused}});
    Reopen();
    EXPECT_EQ(store().LoadOpenState().experiments.at(0).control, paused) << reason;
  }
  Apply({ControlExperiment{1, {}}});
  EXPECT_EQ(store().LoadOpenState().experiments.at(0).control, ExperimentControl{});
  ExpectRefused({ControlExperiment{1, {ExperimentHold::kNone, "why", 0}}});
  ExpectRefused({ControlExperiment{1, {ExperimentHold::kNone, "", kMaxPriority + 1}}});
  ExpectRefused({ControlExperiment{1, {ExperimentHold::kNone, "", 0, BuildPolicy::kOne, std::string(65, 'b')}}});
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

// Closes the experiment with jobs 1 and 2 done, stopped by the wall-time limit (2 nevertheless judged a success), 3
// done, 4 dead.
void StopByTheClock(Store& store) {
  ResultRecord stopped = SampleResult();
  stopped.solver_status = SolveStatus::kTimeLimit;
  ResultRecord unsolved = stopped;
  unsolved.verdict_literal = unsolved.verdict_strict = unsolved.verdict_solid = unsolved.verdict_physical =
      Verdict::kCom;
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
  // The next result may be stopped and retried like the first.
  ResultRecord stopped = SampleResult();
  stopped.solver_status = SolveStatus::kTimeLimit;
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
    EXPECT_NE(ValidateTag(tag), "") << tag;
    ExpectRefused({TagExperiment{1, tag, true}});
  }
  for (const std::string& name : {std::string(), std::string(201, 'x')}) {
    EXPECT_NE(ValidateName(name), "");
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
  // All or nothing: a later refusal restores it.
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
  // Then the same submission is a new experiment.
  NewExperiment again = SampleExperiment(3, 9, 5);
  again.submission_id = "submission-2";
  Apply({CreateExperiment{again}});
}

}  // namespace
}  // namespace legopt::db
