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

// --- Operations. Each is a value; a span of them is applied in order, in one transaction. ----------------------------

/// Adds an experiment with its methods, cells, problems and jobs (all queued). Methods, datasets and problems that are
/// known already are shared. An equal submission id or experiment id is a kConstraint error.
struct CreateExperiment {
  NewExperiment experiment;
};

/// Job queued -> leased; adds attempt number `attempt` (= attempts so far + 1) with its token.
struct LeaseJob {
  std::int64_t job_id = 0;
  int attempt = 0;
  std::int64_t token = 0;  ///< positive, unique
  std::int64_t worker_id = 0;
  std::int64_t at_us = 0;
};

/// Ends the running attempt without a result. `next` is the job's new state: kQueued, kFailed, kDead or kCancelled.
/// The outcome kReturned does not count against the job's maximum of attempts; kRunning and kFinished are not allowed.
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

/// Job leased -> done: ends the running attempt as finished and stores its result, the only one the job will ever have.
struct AcceptResult {
  std::int64_t job_id = 0;
  int attempt = 0;
  ResultRecord result;
  std::string message;
  std::string log_tail;
  std::int64_t at_us = 0;
};

/// Job queued -> done, never leased before: gets a copy of the result of another job, as attempt 1 of the worker that
/// made it, and remembers the job that was solved. FindKnownResults says which jobs are equal; nobody else may be
/// asked.
struct TakeResult {
  std::int64_t job_id = 0;
  std::int64_t source_job_id = 0;  ///< done
  std::int64_t token = 0;          ///< positive, unique; no worker knows it
  std::int64_t at_us = 0;
};

/// Keeps, for audit, a report that came too late for its attempt. The attempt must exist; storing the same attempt's
/// stale report again changes nothing.
struct RecordStaleResult {
  std::int64_t job_id = 0;
  int attempt = 0;
  AttemptOutcome outcome = AttemptOutcome::kFinished;  ///< what the worker reported
  std::string reason;                                  ///< why it was stale
  std::optional<ResultRecord> result;                  ///< empty unless finished
  std::string message;
  std::int64_t at_us = 0;
};

/// All queued and leased jobs -> cancelled, running attempts end as cancelled, experiment -> cancelled, not held.
struct CancelExperiment {
  std::int64_t experiment_id = 0;
  std::int64_t at_us = 0;
};

/// Replaces what was decided about an active experiment.
struct ControlExperiment {
  std::int64_t experiment_id = 0;
  ExperimentControl control;
};

/// All failed and dead jobs -> queued with none of their attempts charged; with `time_limited` also the done ones whose
/// result has the solver status kTimeLimit: that result is kept among the stale ones, its solution with it, and
/// counts no more. At least one job in all; experiment done -> active. A cancelled experiment cannot be retried.
struct RetryExperiment {
  std::int64_t experiment_id = 0;
  bool time_limited = false;
  std::int64_t at_us = 0;  ///< becomes received_at_us of the stale results
};

/// Removes a closed experiment with its cells, jobs, attempts, results, solutions, stale results, tags and events. Its
/// identifiers are never given again; methods, datasets, problems and workers stay.
struct DeleteExperiment {
  std::int64_t experiment_id = 0;
};

/// Gives an experiment of any state another name, legal by FaultOfName.
struct RenameExperiment {
  std::int64_t experiment_id = 0;
  std::string name;
};

/// Gives an experiment of any state a tag, legal by FaultOfTag, or takes it away; no change when it is so already.
struct TagExperiment {
  std::int64_t experiment_id = 0;
  std::string tag;
  bool set = true;
};

/// Experiment active -> done and held no more; every job must be terminal.
struct FinishExperiment {
  std::int64_t experiment_id = 0;
  std::int64_t at_us = 0;
};

/// Adds the worker or, for a known id, updates its description and last sighting.
struct PutWorker {
  WorkerRecord worker;
};

/// Keeps the files of a dataset that an experiment has (docs/datasets.md, "Archives"). Nothing happens to one that is
/// stored already.
struct StoreDataset {
  std::string hash;
  std::string archive;  ///< not empty
};

/// A line of the log that people read: "server_started", "lease_expired", "job_dead", ...
struct RecordEvent {
  std::string kind;  ///< lower_snake word
  std::int64_t at_us = 0;
  std::optional<std::int64_t> experiment_id, job_id, worker_id;
  std::string detail;
};

using StoreOp = std::variant<CreateExperiment, LeaseJob, EndAttempt, AcceptResult, TakeResult, RecordStaleResult,
                             CancelExperiment, ControlExperiment, RetryExperiment, DeleteExperiment, RenameExperiment,
                             TagExperiment, FinishExperiment, PutWorker, StoreDataset, RecordEvent>;

// --- What is read back. ----------------------------------------------------------------------------------------------

/// A job of an open experiment as of the last commit.
struct OpenJob {
  JobState state = JobState::kQueued;
  int attempts = 0;        ///< leases so far
  int returned = 0;        ///< of these, not charged
  std::int64_t token = 0;  ///< of the latest attempt; 0 when there was none
  std::int64_t worker_id = 0;
  AttemptOutcome outcome = AttemptOutcome::kRunning;  ///< of the latest attempt; meaningless when there was none
  bool time_limited = false;                          ///< done, and its result has the solver status kTimeLimit
  bool solved = false;                                ///< done, and a success by the experiment's rule
  std::int64_t leased_at_us = 0;                      ///< of the latest attempt; 0 when there was none
  std::int64_t ended_at_us = 0;                       ///< of the latest attempt; 0 while it runs
};

/// Totals of any experiment, open or closed.
struct ExperimentSummary {
  std::int64_t experiment_id = 0;
  std::string submission_id;
  std::string name;
  std::string spec_hash;
  std::string submitter;
  std::set<std::string> tags;
  std::string dataset;               ///< its name
  std::vector<std::string> methods;  ///< their names, each once, in the order of the table
  ExperimentState state = ExperimentState::kActive;
  ExperimentControl control;
  std::int64_t first_job_id = 0;
  std::int64_t num_jobs = 0;
  Per<JobState, std::int64_t> jobs_by_state;
  Rule rule = Rule::kSolid;     ///< rule by which its results are counted
  std::int64_t solved = 0;      ///< successes by `rule`
  std::int64_t taken_over = 0;  ///< results that jobs of other experiments made
  std::int64_t submitted_at_us = 0;
  std::int64_t finished_at_us = 0;  ///< 0 while active
};

/// How long the solves of a cell took: sums over its results.
struct CellTime {
  std::int64_t wall_us = 0;
  std::int64_t waypoints = 0;
};

/// An experiment with all that the scheduler needs to go on.
struct OpenExperiment {
  std::int64_t experiment_id = 0;
  std::string spec_json;
  std::vector<OpenJob> jobs;         ///< of first_job_id + 0, 1, ...
  std::vector<CellTime> cell_times;  ///< of each cell, by cell id
};

struct OpenState {
  std::int64_t next_experiment_id = 1;
  std::int64_t next_job_id = 1;
  std::int64_t next_cell_id = 1;
  std::int64_t next_worker_id = 1;
  std::vector<ExperimentSummary> experiments;    ///< all, by id
  std::vector<OpenExperiment> open;              ///< the active ones, by id
  std::map<std::int64_t, WorkerRecord> workers;  ///< all, by worker_id
};

struct AttemptRecord {
  std::int64_t token = 0;
  std::int64_t worker_id = 0;
  AttemptOutcome outcome = AttemptOutcome::kRunning;
  JobState job_state = JobState::kQueued;
};

/// Jobs of one cell for which a finished result may be known, and all that such a result has to agree with.
struct ResultSearch {
  struct Problem {
    int number = 0;  ///< in the dataset
    int repetition = 0;
  };
  std::int64_t experiment_id = 0;  ///< of the cell: its own results are not meant
  std::string dataset_hash, method_hash;
  Task task{};
  Initialization initialization{};
  std::int64_t seed = 0;
  std::int64_t effort_limit = 0;        ///< equal; 0: none
  std::int64_t wall_limit_us = 0;       ///< the solve took no longer
  std::int64_t memory_limit_bytes = 0;  ///< its process never had more
  Rule rule = Rule::kSolid;             ///< rule of the searching experiment; sets KnownResult::solved only
  std::optional<std::string> build_id;  ///< of the worker that made it; empty: of any that told its build
  std::vector<Problem> problems;
};

/// A finished result of an equal job.
struct KnownResult {
  std::int64_t job_id = 0;  ///< whose result it is; 0: there is none
  std::int64_t wall_us = 0;
  bool solved = false;  ///< success by the searching experiment's rule
};

/// Facts about the stored archive of a dataset.
struct ArchiveFacts {
  bool has_experiment = false;    ///< an experiment was made on the dataset
  bool stored = false;            ///< the archive is there
  std::int64_t stored_bytes = 0;  ///< total size of the stored archives of all datasets
};

/// The durable memory of the server. Implementations: OpenSqliteStore (db/sqlite_store.h) and MemoryStore
/// (db/memory_store.h); tests/db/store_conformance_test.cpp holds both to the same behaviour.
///
/// Thread rule: one thread at a time. Not to be used across fork().
class Store {
 public:
  virtual ~Store() = default;

  /// Applies all operations in order in one transaction. When it returns they are durable; when it throws StoreError
  /// none of them happened and, if the error is transient(), the same call may be made again.
  virtual void Apply(std::span<const StoreOp> operations) = 0;

  virtual OpenState LoadOpenState() = 0;

  /// An attempt of any job, open or not; empty when it was never leased.
  virtual std::optional<AttemptRecord> FindAttempt(std::int64_t job_id, int attempt) = 0;

  /// The jobs of any experiment, open or not; empty when it is unknown.
  virtual std::optional<OpenExperiment> LoadExperiment(std::int64_t experiment_id) = 0;

  /// Canonical options of the method with this hash; empty when unknown.
  virtual std::optional<std::string> FindMethodOptions(const std::string& hash) = 0;

  /// The packed dataset with this content hash, as StoreDataset stored it; empty when there is none. Its content may be
  /// another than the hash says: the reader has to check it.
  virtual std::optional<std::string> FindDatasetArchive(const std::string& hash) = 0;

  /// Facts about the archive of the dataset with this content hash.
  virtual ArchiveFacts FindArchiveFacts(const std::string& hash) = 0;

  /// For each problem of the search the result that a job may take over, the one with the lowest job id: accepted, not
  /// ended by the clock, judged by all three rules (view reusable_results).
  virtual std::vector<KnownResult> FindKnownResults(const ResultSearch& search) = 0;

  /// Called about once a second, and by Apply: throws StoreError (kDisplaced) while what is written would not be found
  /// again, because the database is not where it was opened. What was applied before is brought to safety then.
  virtual void CheckPlace() {}

  /// Called when the server has nothing else to do: moves the log into the main file, so that it stays small.
  virtual void Idle() {}
};

}  // namespace legopt::db
