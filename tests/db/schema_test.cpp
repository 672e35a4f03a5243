// Illegal rows are impossible: each test tries to write one that a programming error could produce.

#include <gtest/gtest.h>

#include "db/connection.h"
#include "db/migrations.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"

namespace legopt::db {
namespace {

class Schema : public testing::Test {
 protected:
  // Experiment 1: jobs 1 - 4; job 1 done, job 2 leased, job 3 dead, job 4 queued.
  void SetUp() override {
    {
      const auto store = OpenSqliteStore(folder_ / "db.sqlite");
      store->Apply(std::vector<StoreOp>{CreateExperiment{SampleExperiment(1, 1, 1)}, PutWorker{SampleWorker(1)},
                                        LeaseJob{1, 1, 71, 1, 1}, AcceptResult{1, 1, SampleResult(), "", "", 2},
                                        LeaseJob{2, 1, 72, 1, 3}, LeaseJob{3, 1, 73, 1, 4},
                                        EndAttempt{3, 1, AttemptOutcome::kCrashed, JobState::kDead, 11, "", "", 5}});
    }
    connection_ = std::make_unique<Connection>(folder_ / "db.sqlite", Connection::Mode::kReadWriteCreate);
  }

  void ExpectRefused(const std::string& sql) {
    try {
      connection_->Execute(sql);
      ADD_FAILURE() << "accepted: " << sql;
    } catch (const StoreError& error) {
      EXPECT_EQ(error.code(), StoreErrorCode::kConstraint) << sql << "\n" << error.what();
    }
  }

  TemporaryFolder folder_;
  std::unique_ptr<Connection> connection_;
};

TEST_F(Schema, StrictTypes) {
  ExpectRefused("UPDATE jobs SET repetition = 'two' WHERE job_id = 4");
  ExpectRefused("UPDATE workers SET slots = NULL");
}

TEST_F(Schema, UnknownWords) {
  ExpectRefused("UPDATE jobs SET state = 'running' WHERE job_id = 4");
  ExpectRefused("UPDATE attempts SET outcome = 'ok' WHERE job_id = 2");
  ExpectRefused("UPDATE experiments SET state = 'paused'");
  ExpectRefused("UPDATE cells SET task = 'A dance'");  // the schema does not list the tasks
  ExpectRefused("UPDATE experiments SET builds = 'some'");
  ExpectRefused("UPDATE experiments SET build_id = ''");
  ExpectRefused("UPDATE methods SET collision = 'Solids'");
  ExpectRefused("UPDATE cells SET initialization = 'hard'");
  ExpectRefused("INSERT INTO problems (dataset_id, task, problem_id, waypoints) VALUES (1, '', 9, 1)");
  ExpectRefused("INSERT INTO events (at_us, kind) VALUES (1, 'Not A Word')");
}

TEST_F(Schema, Ranges) {
  ExpectRefused("UPDATE methods SET sample_size = 0");
  ExpectRefused("UPDATE methods SET sample_size = 101");
  ExpectRefused("UPDATE methods SET multi_starts = -1");
  ExpectRefused("UPDATE methods SET incremental = 2");
  ExpectRefused("UPDATE problems SET waypoints = 0");
  ExpectRefused("UPDATE experiments SET max_attempts = 0");
  ExpectRefused("UPDATE experiments SET seed = -1");
  ExpectRefused("UPDATE jobs SET attempts = -1 WHERE job_id = 4");
  ExpectRefused("UPDATE workers SET slots = 0");
  ExpectRefused("UPDATE attempts SET token = 0 WHERE job_id = 2");
}

TEST_F(Schema, FiguresOfMotionsHaveRanges) {
  connection_->Execute("DROP TRIGGER results_are_final");
  connection_->Execute("UPDATE results SET windows = 3, windows_solved = 3, interpolation_free_share = 1");
  ExpectRefused("UPDATE results SET windows = 0");
  ExpectRefused("UPDATE results SET windows_solved = 4");
  ExpectRefused("UPDATE results SET interpolation_free_share = 1.1");
  ExpectRefused("UPDATE results SET interpolation_self_depth_m = -1e-9");
  ExpectRefused("UPDATE results SET interpolation_environment_depth_m = -1e-9");
  connection_->Execute("UPDATE results SET duration_s = 0, velocity_limited_share = 1, contact_limited_share = 0");
  ExpectRefused("UPDATE results SET duration_s = -1e-9");
  ExpectRefused("UPDATE results SET reduced_duration_s = -1e-9");
  ExpectRefused("UPDATE results SET torque_limited_share = 1.1");
  ExpectRefused("UPDATE cells SET wall_limit_us = 0");
}

TEST_F(Schema, HashesAreHashes) {
  ExpectRefused("UPDATE datasets SET hash = 'abc'");
  ExpectRefused("UPDATE datasets SET hash = '" + std::string(64, 'G') + "'");
  ExpectRefused("UPDATE methods SET hash = '" + std::string(63, 'a') + "'");
}

TEST_F(Schema, ForeignKeys) {
  ExpectRefused("DELETE FROM datasets");
  ExpectRefused("DELETE FROM methods");
  ExpectRefused("DELETE FROM jobs WHERE job_id = 1");
  ExpectRefused("DELETE FROM workers");
  ExpectRefused("UPDATE cells SET experiment_id = 9");
  ExpectRefused("UPDATE jobs SET problem_key = 99 WHERE job_id = 4");
  ExpectRefused("INSERT INTO waypoints (job_id, waypoint, x) VALUES (4, 0, x'0000000000000000')");
  ExpectRefused("INSERT INTO events (at_us, kind, job_id) VALUES (1, 'job_dead', 99)");
}

TEST_F(Schema, UniqueKeys) {
  ExpectRefused("INSERT INTO datasets (name, hash) SELECT 'again', hash FROM datasets");
  ExpectRefused(
      "INSERT INTO methods (name, hash, options_json, multi_starts, sample_size, incremental) "
      "SELECT name, hash, options_json, 5, 100, 0 FROM methods");
  ExpectRefused("INSERT INTO problems (dataset_id, task, problem_id, waypoints) VALUES (1, 'posture', 0, 2)");
  ExpectRefused(
      "INSERT INTO cells SELECT 9, experiment_id, method_id, task, initialization, 1, 1, NULL FROM cells LIMIT 1");
  ExpectRefused(
      "INSERT INTO jobs (job_id, cell_id, problem_key, repetition, max_attempts) "
      "SELECT 9, cell_id, problem_key, repetition, 3 FROM jobs WHERE job_id = 4");
  ExpectRefused(
      "UPDATE jobs SET state = 'leased', attempts = 2 WHERE job_id = 2;"
      "INSERT INTO attempts (job_id, attempt, worker_id, token, leased_at_us) VALUES (2, 2, 1, 99, 1)");
}

TEST_F(Schema, AttemptsAndStatesAgree) {
  ExpectRefused("UPDATE jobs SET state = 'leased' WHERE job_id = 4");
  ExpectRefused("UPDATE jobs SET attempts = 4 WHERE job_id = 4");
  ExpectRefused("UPDATE jobs SET returned = 1 WHERE job_id = 4");
  ExpectRefused("UPDATE attempts SET ended_at_us = 9 WHERE job_id = 2");
  ExpectRefused("UPDATE attempts SET outcome = 'crashed' WHERE job_id = 2");
  ExpectRefused("INSERT INTO attempts (job_id, attempt, worker_id, token, leased_at_us) VALUES (4, 1, 1, 99, 1)");
}

TEST_F(Schema, TerminalJobsStay) {
  ExpectRefused("UPDATE jobs SET state = 'queued' WHERE job_id = 1");
  ExpectRefused("UPDATE jobs SET state = 'queued' WHERE job_id = 3");
  ExpectRefused("UPDATE jobs SET attempts = 2 WHERE job_id = 3");
}

TEST_F(Schema, OnlyDeadAndFailedJobsAreTriedAgain) {
  ExpectRefused("UPDATE jobs SET state = 'queued', returned = attempts WHERE job_id = 1");
  ExpectRefused("UPDATE jobs SET state = 'queued' WHERE job_id = 3");
  ExpectRefused("UPDATE jobs SET state = 'leased', returned = attempts WHERE job_id = 3");
  connection_->Execute("UPDATE jobs SET state = 'queued', returned = attempts WHERE job_id = 3");
}

TEST_F(Schema, OnlyResultsThatTheClockStoppedMakeWay) {
  ExpectRefused("DELETE FROM results");
  ExpectRefused("DELETE FROM waypoints");
  ExpectRefused("DELETE FROM violations");
  ExpectRefused("UPDATE violations SET value = 0");
  connection_->Execute("DROP TRIGGER results_are_final; UPDATE results SET solver_status = 'time_limit'");
  ExpectRefused("DELETE FROM results");  // not archived anywhere
  connection_->Execute(
      "INSERT INTO stale_results (job_id, attempt, outcome, reason, received_at_us, solver_status) "
      "VALUES (1, 1, 'finished', 'why', 1, 'time_limit')");
  ExpectRefused("UPDATE jobs SET state = 'queued', returned = attempts WHERE job_id = 1");  // it still has its result
  connection_->Execute(
      "BEGIN; PRAGMA defer_foreign_keys = ON; DELETE FROM results; DELETE FROM waypoints; "
      "DELETE FROM violations");
  ExpectRefused("UPDATE jobs SET state = 'queued' WHERE job_id = 1");
  ExpectRefused("UPDATE jobs SET state = 'leased', returned = attempts WHERE job_id = 1");
  connection_->Execute("UPDATE jobs SET state = 'queued', returned = attempts WHERE job_id = 1; COMMIT");
  ExpectRefused("DELETE FROM stale_results");
}

// Foreign keys are deferred so that they do not hide rows which the triggers accept.
TEST_F(Schema, NothingOfAnExperimentGoesBeforeIt) {
  connection_->Execute("BEGIN; PRAGMA defer_foreign_keys = ON");
  for (const char* table : {"waypoints", "violations", "results", "attempts", "jobs", "experiments"}) {
    ExpectRefused("DELETE FROM " + std::string(table));
  }
}

TEST_F(Schema, AnExperimentGoesWithAllThatBelongsToIt) {
  connection_->Execute("UPDATE jobs SET state = 'cancelled' WHERE state IN ('queued', 'leased')");
  connection_->Execute("UPDATE experiments SET state = 'cancelled', finished_at_us = 9");
  ExpectRefused("DELETE FROM experiments");
  ExpectRefused("BEGIN; PRAGMA defer_foreign_keys = ON; DELETE FROM experiments; COMMIT");
  connection_->Execute("ROLLBACK");
}

TEST_F(Schema, TagsAndJointNames) {
  ExpectRefused("INSERT INTO experiment_tags VALUES (1, '')");
  ExpectRefused("INSERT INTO experiment_tags VALUES (1, 'a,b')");
  ExpectRefused("INSERT INTO experiment_tags VALUES (2, 'a')");
  ExpectRefused("INSERT INTO experiment_tags VALUES (1, '" + std::string(101, 'x') + "')");
  ExpectRefused("UPDATE experiments SET submitter = '" + std::string(201, 'x') + "'");
  ExpectRefused("UPDATE datasets SET joint_names = 'hip'");
  ExpectRefused("UPDATE datasets SET joint_names = '[]'");
  ExpectRefused("INSERT INTO deleted_ids VALUES ('problem', 1)");
  connection_->Execute("UPDATE datasets SET joint_names = '[\"hip\"]'");
}

TEST_F(Schema, HoldsHaveReasonsAndPrioritiesBounds) {
  ExpectRefused("UPDATE experiments SET hold = 'stopped'");
  ExpectRefused("UPDATE experiments SET hold = 'held'");
  ExpectRefused("UPDATE experiments SET hold = 'paused', hold_reason = 'why'");
  ExpectRefused("UPDATE experiments SET priority = 1001");
  connection_->Execute("UPDATE experiments SET hold = 'held', hold_reason = 'why', priority = -1000");
}

TEST_F(Schema, DoneNeedsAResultAndAResultNeedsALease) {
  ExpectRefused("UPDATE jobs SET state = 'done' WHERE job_id = 2");
  const std::string copy =
      "INSERT INTO results (job_id, cell_id, attempt, solver_status, iterations, restarts, wall_us, cpu_us, "
      "involuntary_context_switches, peak_memory_bytes, verdict_literal, verdict_strict, cost, num_waypoints, "
      "received_at_us) SELECT ";
  const std::string rest =
      ", solver_status, iterations, restarts, wall_us, cpu_us, involuntary_context_switches, peak_memory_bytes, "
      "verdict_literal, verdict_strict, cost, num_waypoints, received_at_us FROM results WHERE job_id = 1";
  ExpectRefused(copy + "1, 1, 1" + rest);  // second result
  ExpectRefused(copy + "4, 2, 1" + rest);  // queued
  ExpectRefused(copy + "3, 2, 1" + rest);  // dead
  ExpectRefused(copy + "2, 1, 2" + rest);  // wrong attempt
  ExpectRefused(copy + "2, 2, 1" + rest);  // wrong cell
  connection_->Execute(copy + "2, 1, 1" + rest);
}

TEST_F(Schema, ResultsAreFinalAndHonest) {
  ExpectRefused("UPDATE results SET cost = 1");
  connection_->Execute("DROP TRIGGER results_are_final");
  ExpectRefused("UPDATE results SET cost = NULL");
  ExpectRefused("UPDATE results SET verdict_literal = 'Not a name'");
  ExpectRefused("UPDATE results SET solver_status = 'fine'");
  ExpectRefused("UPDATE results SET wall_us = -1");
  ExpectRefused("UPDATE results SET num_waypoints = 0");
}

TEST_F(Schema, WaypointsAreWholeNumbersOfDoubles) {
  ExpectRefused("UPDATE waypoints SET x = x'00'");
  ExpectRefused("UPDATE waypoints SET x = x''");
  ExpectRefused("UPDATE waypoints SET waypoint = -1");
}

TEST_F(Schema, OpenExperimentCannotBeClosed) {
  ExpectRefused("UPDATE experiments SET state = 'done', finished_at_us = 9");
  ExpectRefused("UPDATE experiments SET finished_at_us = 9");
}

TEST_F(Schema, DoubleQuotedStringsAreErrors) {
  EXPECT_THROW(connection_->QueryInt("SELECT \"no such column\""), StoreError);
}

TEST_F(Schema, WholeFileIsSound) {
  EXPECT_EQ(connection_->QueryText("PRAGMA integrity_check"), "ok");
  EXPECT_EQ(connection_->QueryInt("SELECT count(*) FROM pragma_foreign_key_check"), 0);
  EXPECT_EQ(connection_->QueryInt("PRAGMA application_id"), kApplicationId);
  EXPECT_EQ(connection_->QueryInt("PRAGMA user_version"), SchemaVersion());
}

}  // namespace
}  // namespace legopt::db
