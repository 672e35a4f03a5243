#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "db/records.h"
#include "db/store_error.h"

namespace legopt::db {

// --- Operations. Each is a value; Apply executes a span of them in order, in one transaction. -----------------------

/// Adds an experiment with its methods, cells, problems and jobs (all queued). Existing methods, datasets and problems
/// are shared. A duplicate submission id or experiment id is a kConstraint error.
struct CreateExperiment {
  NewExperiment experiment;
};

/// Job queued -> leased; adds attempt number `attempt` (= previous attempts + 1) with its token.
struct LeaseJob {
  std::int64_t job_id = 0;
  int attempt = 0;
  std::int64_t token = 0;  ///< positive, unique
  std::int64_t worker_id = 0;
  std::int64_t at_us = 0;
};

/// Ends the running attempt without a result. `next` is the job's new state: kQueued, kFailed, kDead or kCancelled. The
/// outcome kReturned does not count towards the job's maximum number of attempts; kRunning and kFinished are not
/// allowed.
struct EndAttempt {
  std::int64_t job_id = 0;
  int attempt = 0;
  AttemptOutcome outcome = AttemptOutcome::kCrashed;
  JobState next = JobState::kQueued;
  int exit_signal = 0;  ///< 0: none
  std::string message;
  std::string log_tail;
  std::int64_t at_us = 0;
};

/// Job leased -> done: ends the running attempt as finished and stores its result, the only one that the job will ever
/// have.
struct AcceptResult {
  std::int64_t job_id = 0;
  int attempt = 0;
  ResultRecord result;
  std::string message;
  std::string log_tail;
  std::int64_t at_us = 0;
};

/// Job queued -> done, never leased before: copies the result of another job, as attempt 1 of the worker that produced
/// it, and records the source job. The source must come from FindKnownResults, which decides whether jobs are
/// identical.
struct ReuseResult {
  std::int64_t job_id = 0;
  std::int64_t source_job_id = 0;  ///< a done job
  std::int64_t token = 0;          ///< positive, unique; not known to any worker
  std::int64_t at_us = 0;
};

/// Stores a report that arrived too late for its attempt, for auditing. The attempt must exist. A second stale report
/// for an attempt changes nothing.
struct RecordStaleResult {
  std::int64_t job_id = 0;
  int attempt = 0;
  AttemptOutcome outcome = AttemptOutcome::kFinished;  ///< outcome reported by the worker
  std::string reason;                                  ///< why the report is stale
  std::optional<ResultRecord> result;                  ///< empty unless the outcome is kFinished
  std::string message;
  std::int64_t at_us = 0;
};

/// All queued and leased jobs -> cancelled, running attempts end as cancelled, experiment -> cancelled and not held.
struct CancelExperiment {
  std::int64_t experiment_id = 0;
  std::int64_t at_us = 0;
};

/// Replaces the control settings of an active experiment.
struct ControlExperiment {
  std::int64_t experiment_id = 0;
  ExperimentControl control;
};

/// All failed and dead jobs -> queued; their previous attempts no longer count. With `time_limited`, done jobs whose
/// result has the solver status kTimeLimit are re-queued as well; their results and solutions become stale and are
/// excluded from all figures. At least one job must be affected; experiment done -> active. A cancelled experiment
/// cannot be retried.
struct RetryExperiment {
  std::int64_t experiment_id = 0;
  bool time_limited = false;
  std::int64_t at_us = 0;
};

/// Removes a closed experiment with its cells, jobs, attempts, results, solutions, stale results, tags and events. Its
/// identifiers are never reused; methods, datasets, problems and workers are kept.
struct DeleteExperiment {
  std::int64_t experiment_id = 0;
};

/// Renames an experiment in any state. The name must pass ValidateName.
struct RenameExperiment {
  std::int64_t experiment_id = 0;
  std::string name;
};

/// Adds or removes a tag of an experiment in any state; no change if already present or absent. The tag must pass
/// ValidateTag.
struct TagExperiment {
  std::int64_t experiment_id = 0;
  std::string tag;
  bool set = true;
};

/// Experiment active -> done and not held; every job must be terminal.
struct FinishExperiment {
  std::int64_t experiment_id = 0;
  std::int64_t at_us = 0;
};

/// Adds a worker or, for a known id, updates its description and the time it was last seen.
struct PutWorker {
  WorkerRecord worker;
};

/// Stores the files of a dataset used by an experiment (docs/reference/datasets.md, "Archives"). Does nothing if they
/// are already stored.
struct StoreDataset {
  std::string hash;
  std::string archive;  ///< not empty
};

/// A line of the event log for users: "server_started", "lease_expired", "job_dead", ...
struct RecordEvent {
  std::string kind;  ///< lower_snake identifier
  std::int64_t at_us = 0;
  std::optional<std::int64_t> experiment_id, job_id, worker_id;
  std::string detail;
};

using StoreOp = std::variant<CreateExperiment, LeaseJob, EndAttempt, AcceptResult, ReuseResult, RecordStaleResult,
                             CancelExperiment, ControlExperiment, RetryExperiment, DeleteExperiment, RenameExperiment,
                             TagExperiment, FinishExperiment, PutWorker, StoreDataset, RecordEvent>;

// --- Values that are read back. --------------------------------------------------------------------------------------

/// A job of an open experiment, as of the last commit.
struct OpenJob {
  JobState state = JobState::kQueued;
  int attempts = 0;        ///< number of leases
  int returned = 0;        ///< number of attempts that are not charged
  std::int64_t token = 0;  ///< token of the latest attempt; 0 if none
  std::int64_t worker_id = 0;
  AttemptOutcome outcome = AttemptOutcome::kRunning;  ///< outcome of the latest attempt; meaningless if there was none
  bool time_limited = false;                          ///< done with solver status kTimeLimit
  bool solved = false;                                ///< done and solved according to the experiment's rule
  std::int64_t leased_at_us = 0;                      ///< time of the latest attempt; 0 if none
  std::int64_t ended_at_us = 0;                       ///< time of the latest attempt; 0 while it runs
};

/// Totals of an experiment, open or closed.
struct ExperimentSummary {
  std::int64_t experiment_id = 0;
  std::string submission_id;
  std::string name;
  std::string spec_hash;
  std::string submitter;
  std::set<std::string> tags;
  std::string dataset;
  std::vector<std::string> methods;  ///< distinct method names, in the order of the table
  ExperimentState state = ExperimentState::kActive;
  ExperimentControl control;
  std::int64_t first_job_id = 0;
  std::int64_t num_jobs = 0;
  EnumArray<JobState, std::int64_t> jobs_by_state;
  Rule rule = Rule::kSolid;     ///< rule that counts its results
  std::int64_t solved = 0;      ///< number of successes by `rule`
  std::int64_t taken_over = 0;  ///< number of results reused from other experiments
  std::int64_t submitted_at_us = 0;
  std::int64_t finished_at_us = 0;  ///< 0 while active
};

/// Solve times of a cell, summed over its results.
struct CellTime {
  std::int64_t wall_us = 0;
  std::int64_t waypoints = 0;
};

/// An active experiment with all data that the scheduler needs to resume it.
struct OpenExperiment {
  std::int64_t experiment_id = 0;
  std::string spec_json;
  std::vector<OpenJob> jobs;         ///< jobs first_job_id, first_job_id + 1, ...
  std::vector<CellTime> cell_times;  ///< one per cell, in the order of cell ids
};

struct OpenState {
  std::int64_t next_experiment_id = 1;
  std::int64_t next_job_id = 1;
  std::int64_t next_cell_id = 1;
  std::int64_t next_worker_id = 1;
  std::vector<ExperimentSummary> experiments;    ///< all experiments, by id
  std::vector<OpenExperiment> open;              ///< active experiments, by id
  std::map<std::int64_t, WorkerRecord> workers;  ///< all workers, by worker_id
};

struct AttemptRecord {
  std::int64_t token = 0;
  std::int64_t worker_id = 0;
  AttemptOutcome outcome = AttemptOutcome::kRunning;
  JobState job_state = JobState::kQueued;
};

/// A search for results that jobs of one cell can reuse: the jobs, and all values that a reusable result must match.
struct ResultSearch {
  struct Problem {
    int number = 0;  ///< problem number in the dataset
    int repetition = 0;
  };
  std::int64_t experiment_id = 0;  ///< experiment of the cell; its own results are excluded
  std::string dataset_hash, method_hash;
  Task task{};
  Initialization initialization{};
  std::int64_t seed = 0;
  std::int64_t effort_limit = 0;        ///< must be equal; 0: none
  std::int64_t wall_limit_us = 0;       ///< upper bound of the result's solve time
  std::int64_t memory_limit_bytes = 0;  ///< upper bound of the result's peak memory
  Rule rule = Rule::kSolid;             ///< rule of the searching experiment; only KnownResult::solved depends on it
  std::optional<std::string> build_id;  ///< build of the worker that made the result; nullopt: any known build
  std::vector<Problem> problems;
};

/// A finished result of an identical job.
struct KnownResult {
  std::int64_t job_id = 0;  ///< job that has the result; 0: none found
  std::int64_t wall_us = 0;
  bool solved = false;  ///< success by the searching experiment's rule
};

/// Facts about the stored archive of a dataset.
struct ArchiveFacts {
  bool has_experiment = false;    ///< an experiment uses the dataset
  bool stored = false;            ///< the archive is stored
  std::int64_t stored_bytes = 0;  ///< total size of the stored archives of all datasets
};

/// Persistent storage of the server. Implementations: OpenSqliteStore (db/sqlite_store.h) and MemoryStore
/// (tests/doubles/memory_store.h); tests/db/store_conformance_test.cpp tests that both behave identically.
///
/// Thread rule: one thread at a time. Not to be used across fork().
class Store {
 public:
  virtual ~Store() = default;

  /// Applies all operations in order in one transaction. They are durable when it returns. If it throws StoreError,
  /// none of them was applied; if the error is transient(), the call may be repeated.
  virtual void Apply(std::span<const StoreOp> operations) = 0;

  virtual OpenState LoadOpenState() = 0;

  /// Returns an attempt of any job, open or not; nullopt if it was never leased.
  virtual std::optional<AttemptRecord> FindAttempt(std::int64_t job_id, int attempt) = 0;

  /// Returns the jobs of any experiment, open or not; nullopt if unknown.
  virtual std::optional<OpenExperiment> LoadExperiment(std::int64_t experiment_id) = 0;

  /// Returns the canonical options of the method with this hash; nullopt if unknown.
  virtual std::optional<std::string> FindMethodOptions(const std::string& hash) = 0;

  /// Returns the packed dataset with this content hash, as stored by StoreDataset; nullopt if there is none. The caller
  /// must verify that the content matches the hash.
  virtual std::optional<std::string> FindDatasetArchive(const std::string& hash) = 0;

  /// Returns facts about the archive of the dataset with this content hash.
  virtual ArchiveFacts FindArchiveFacts(const std::string& hash) = 0;

  /// Returns for each problem of the search the reusable result with the lowest job id. Reusable results are accepted,
  /// not stopped by the wall-time limit, and judged by all four rules (view reusable_results).
  virtual std::vector<KnownResult> FindKnownResults(const ResultSearch& search) = 0;

  /// Called about once a second and by Apply. Throws StoreError (kDisplaced) while the database is not at the path
  /// where it was opened, because new data could not be found again. Data applied before is rescued.
  virtual void CheckPlace() {}

  /// Called when the server is idle: moves the log into the main file to keep the log small.
  virtual void Idle() {}
};

}  // namespace legopt::db
