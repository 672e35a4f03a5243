// Guarantees of every Store for jobs, their attempts and results, workers and events.

#include "tests/db/store_conformance.h"

#include <cmath>
#include <functional>

namespace legopt::db {
namespace {

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
  ExpectRefused(with([](ResultRecord& r) { r.interpolation_self_depth_m = -1e-9; }));
  ExpectRefused(with([](ResultRecord& r) { r.interpolation_free_share = 1.5; }));
  ExpectRefused(with([](ResultRecord& r) { r.duration_s = -1e-9; }));
  ExpectRefused(with([](ResultRecord& r) { r.torque_limited_share = 1.1; }));
  ExpectRefused(with([](ResultRecord& r) { r.windows_solved = 1; }));
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

TEST_P(StoreConformance, WorkerIsUpdatedByItsId) {
  Apply({PutWorker{SampleWorker(1)}});
  WorkerRecord renamed = SampleWorker(1);
  renamed.name = "renamed";
  Apply({PutWorker{renamed}});
  Reopen();
  const WorkerRecord stored = store().LoadOpenState().workers.at(1);
  EXPECT_EQ(stored.name, "renamed");
  EXPECT_EQ(stored.build_id, renamed.build_id);
  EXPECT_EQ(stored.processor, renamed.processor);
  EXPECT_EQ(stored.processors, renamed.processors);
  EXPECT_EQ(stored.memory_bytes, renamed.memory_bytes);
  EXPECT_EQ(stored.load, renamed.load);
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

INSTANTIATE_TEST_SUITE_P(Stores, StoreConformance, testing::Values(StoreKind::kSqlite, StoreKind::kMemory),
                         [](const auto& param) { return param.param == StoreKind::kSqlite ? "Sqlite" : "Memory"; });

}  // namespace
}  // namespace legopt::db
