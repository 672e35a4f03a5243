#include "db/sqlite_store.h"

#include <bit>
#include <ctime>
#include <span>
#include <string>

#include "db/backup.h"
#include "db/file_state.h"
#include "db/foreign_keys.h"
#include "db/migrations.h"
#include "db/sqlite_statements.h"
#include "db/sqlite_store_impl.h"

namespace legopt::db {
namespace {

static_assert(std::endian::native == std::endian::little, "waypoints are stored as little-endian float64");

// Called before the first write: SQLite itself detects a damaged page only when it reads it. CHECK constraints are not
// evaluated, which takes three quarters of the time and finds no damaged page: 'legopt service doctor' evaluates them.
void RequireSoundPages(Connection& connection) {
  connection.Execute("PRAGMA ignore_check_constraints = 1");
  const std::string verdict = connection.QueryText("PRAGMA quick_check(1)");
  connection.Execute("PRAGMA ignore_check_constraints = 0");
  if (verdict == "ok") return;
  throw StoreError(StoreErrorCode::kCorrupt, connection.path().string() + ": the file is damaged (" + verdict +
                                                 "); restore a backup: 'legopt service restore BACKUP --db FILE'");
}

// Checks the references of the small tables, for which a start does not take longer. Tables with a row or more for each
// job (jobs, attempts, results, waypoints, events) may have 10^7 rows: 'legopt service doctor' checks them.
void RequireSoundReferences(Connection& connection) {
  Statement tables(connection,
                   "SELECT name FROM sqlite_schema WHERE type = 'table' AND name IN ('problems', 'experiments', "
                   "'cells', 'cell_results', 'experiment_tags', 'result_workers', 'dataset_archives')",
                   false);  // older schemas lack some
  while (tables.Step()) {
    const std::string table = tables.column_text(0);
    const BrokenForeignKeys broken = FindBrokenForeignKeys(connection, table);
    if (broken.rows == 0) continue;
    throw StoreError(StoreErrorCode::kCorrupt, connection.path().string() + ": " + broken.first +
                                                   "; restore a backup: 'legopt service restore BACKUP --db FILE'");
  }
}

// Checks the log before the connection is opened, because SQLite replays the log with the first read.
std::filesystem::path WithOwnLog(const std::filesystem::path& path) {
  RequireOwnLog(path);
  return path;
}

std::size_t NumRows(const ResultRecord& result) {
  return result.waypoint_size > 0 ? result.waypoints.size() / static_cast<std::size_t>(result.waypoint_size) : 0;
}

}  // namespace

std::unique_ptr<Store> OpenSqliteStore(const std::filesystem::path& path) {
  std::error_code error;
  // Check before the lock file is created: SQLite would open a device and fail later.
  if (const auto status = std::filesystem::status(path, error);
      std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw StoreError(StoreErrorCode::kUnwritable,
                     path.string() + ": is not a file; name a file, which is created when it is missing");
  }
  return std::make_unique<SqliteStore>(path);
}

SqliteStore::SqliteStore(const std::filesystem::path& path)
    : file_(path), connection_(WithOwnLog(file_.path()), Connection::Mode::kReadWriteCreate) {
  OpenForWriting(path);
}

void SqliteStore::OpenForWriting(const std::filesystem::path& path) {
  // Change nothing before the file is identified as a legopt database.
  const Identity identity = Identify(connection_);
  if (identity.version == SchemaVersion()) RequireIntactTables(connection_);
  if (!identity.empty) {
    RequireSoundPages(connection_);
    RequireSoundReferences(connection_);
  }
  if (connection_.read_only()) {
    throw StoreError(StoreErrorCode::kUnwritable,
                     path.string() + ": the database file is read-only; check permissions");
  }
  if (connection_.QueryText("PRAGMA journal_mode = WAL") != "wal") {
    throw StoreError(StoreErrorCode::kUnwritable,
                     path.string() + ": write-ahead logging is not possible here; use a local disk");
  }
  // FULL: a commit is on disk when it returns. The log is truncated to 64 MiB after each checkpoint.
  connection_.Execute(
      "PRAGMA synchronous = FULL; PRAGMA journal_size_limit = 67108864; PRAGMA wal_autocheckpoint = 4000;"
      "PRAGMA cache_size = -16384; PRAGMA temp_store = MEMORY");
  Migrate(connection_);
  BeginSession(connection_, file_.lock());
  statements_.emplace(connection_);
  connection_.QueryInt("SELECT count(*) FROM experiments");  // the first read opens the side files
  file_.RememberSideFiles();
}

SqliteStore::~SqliteStore() {
  statements_.reset();
  // Best effort, without waiting for readers: a remaining log is replayed at the next start.
  try {
    connection_.SetBusyTimeout(std::chrono::milliseconds(0));
    connection_.Execute("PRAGMA wal_checkpoint(TRUNCATE)");
  } catch (const StoreError&) {
  }
}

SqliteStore::Statements::Statements(Connection& c)
    : lease_job(c, sql::kLeaseJob),
      insert_attempt(c, sql::kInsertAttempt),
      end_attempt(c, sql::kEndAttempt),
      end_job(c, sql::kEndJob),
      insert_result(c, sql::InsertResult()),
      insert_waypoint(c, sql::kInsertWaypoint),
      insert_unsolved(c, sql::kInsertUnsolved),
      insert_violation(c, sql::kInsertViolation),
      insert_stale(c, sql::InsertStale()),
      cancel_attempts(c, sql::kCancelAttempts),
      cancel_jobs(c, sql::kCancelJobs),
      control_experiment(c, sql::kControlExperiment),
      retry_jobs(c, sql::kRetryJobs),
      reopen_experiment(c, sql::kReopenExperiment),
      close_experiment(c, sql::kCloseExperiment),
      put_worker(c, sql::kPutWorker),
      insert_event(c, sql::kInsertEvent),
      count_commit(c, sql::kCountCommit),
      put_dataset(c, sql::kPutDataset),
      find_dataset(c, sql::kFindDataset),
      put_method(c, sql::kPutMethod),
      find_method(c, sql::kFindMethod),
      find_problems(c, sql::kFindProblems),
      insert_problem(c, sql::InsertProblems(1)),
      insert_problem_batch(c, sql::InsertProblems(sql::kRowsPerBatch)),
      insert_experiment(c, sql::kInsertExperiment),
      insert_cell(c, sql::kInsertCell),
      insert_job(c, sql::InsertJobs(1)),
      insert_job_batch(c, sql::InsertJobs(sql::kRowsPerBatch)),
      find_attempt(c, sql::kFindAttempt),
      find_options(c, sql::kFindOptions),
      find_equal_experiments(c, sql::kFindEqualExperiments),
      find_known_result(c, sql::kFindKnownResult),
      take_job(c, sql::kTakeJob),
      take_attempt(c, sql::kTakeAttempt),
      take_result(c, sql::TakeResultOf()),
      take_waypoints(c, sql::kTakeWaypoints),
      take_unsolved(c, sql::kTakeUnsolved),
      take_violations(c, sql::kTakeViolations) {}

void SqliteStore::Apply(std::span<const StoreOp> operations) {
  CheckPlace();
  Transaction transaction(connection_);
  try {
    for (const StoreOp& operation : operations) {
      std::visit([this](const auto& op) { Do(op); }, operation);
    }
    statements_->count_commit.Run();
  } catch (const StoreError& error) {
    // The prepared statements matched the schema at the start.
    if (error.code() != StoreErrorCode::kBadQuery) throw;
    throw StoreError(StoreErrorCode::kCorrupt, std::string("not an intact legopt database any more: ") + error.what() +
                                                   "; another program changed its schema: restore a backup");
  }
  // Check once more just before the commit. If the file is moved after this, the next check rescues its contents.
  if (const auto place = file_.Look(); place != DatabaseFile::Place::kThere) ThrowDisplaced(place, "");
  transaction.Commit();
  written_since_checkpoint_ = true;
}

void SqliteStore::RequireOneChange(const char* operation, std::int64_t job_id) {
  if (connection_.changes() == 1) return;
  throw StoreError(StoreErrorCode::kConstraint, std::string(operation) + ": not allowed in the state of " +
                                                    std::to_string(job_id) + "; this is a defect of legopt");
}

void SqliteStore::Do(const LeaseJob& op) {
  statements_->lease_job.Run(op.job_id, op.attempt);
  RequireOneChange("LeaseJob", op.job_id);
  statements_->insert_attempt.Run(op.job_id, op.attempt, op.token, op.worker_id, op.at_us);
}

void SqliteStore::EndJob(std::int64_t job_id, int attempt, JobState next, bool returned) {
  statements_->end_job.Run(job_id, attempt, next, returned ? 1 : 0);
  RequireOneChange("EndAttempt", job_id);
}

void SqliteStore::Do(const EndAttempt& op) {
  if (op.next == JobState::kLeased || op.next == JobState::kDone || op.outcome == AttemptOutcome::kRunning ||
      op.outcome == AttemptOutcome::kFinished) {
    throw StoreError(StoreErrorCode::kConstraint, "EndAttempt: job " + std::to_string(op.job_id) + " cannot end as " +
                                                      std::string(ToString(op.outcome)));
  }
  statements_->end_attempt.Run(op.job_id, op.attempt, op.outcome, op.exit_signal, op.message, op.log_tail, op.at_us);
  RequireOneChange("EndAttempt", op.job_id);
  EndJob(op.job_id, op.attempt, op.next, op.outcome == AttemptOutcome::kReturned);
}

void SqliteStore::InsertWaypoints(std::int64_t job_id, const ResultRecord& result) {
  const auto insert = [job_id](Statement& statement, std::int64_t first, std::span<const double> values,
                               std::size_t num_rows) {
    const std::size_t size = num_rows > 0 ? values.size() / num_rows : 0;
    for (std::size_t row = 0; row < num_rows; ++row) {
      statement.BindAll(job_id, first + static_cast<std::int64_t>(row));
      statement.BindBlob(3, values.data() + row * size, size * sizeof(double)).RunBound();
    }
  };
  insert(statements_->insert_waypoint, 0, result.waypoints, NumRows(result));
  if (result.unsolved.empty()) return;
  insert(statements_->insert_unsolved, result.first_unsolved, result.unsolved,
         static_cast<std::size_t>(result.num_unsolved));
}

void SqliteStore::Do(const AcceptResult& op) {
  const ResultRecord& r = op.result;
  if (const std::string fault = FaultOf(r); !fault.empty()) {
    throw StoreError(StoreErrorCode::kConstraint, "AcceptResult: job " + std::to_string(op.job_id) + ": " + fault);
  }
  statements_->insert_result.BindAll(op.job_id, op.attempt, op.at_us);
  sql::Bind(statements_->insert_result, sql::kFirstOfResult, sql::Columns::kAll, r);
  statements_->insert_result.RunBound();
  InsertWaypoints(op.job_id, r);
  for (const Violation& violation : r.violations) {
    statements_->insert_violation.Run(op.job_id, violation.check, violation.rule, violation.waypoint, violation.subject,
                                      violation.value);
  }
  statements_->end_attempt.Run(op.job_id, op.attempt, AttemptOutcome::kFinished, 0, op.message, op.log_tail, op.at_us);
  RequireOneChange("AcceptResult", op.job_id);
  EndJob(op.job_id, op.attempt, JobState::kDone, false);
}

// Performs the steps of a solved job: lease, result under that lease, done.
void SqliteStore::Do(const ReuseResult& op) {
  constexpr int kAttempt = 1;
  statements_->take_job.Run(op.job_id, op.source_job_id);
  RequireOneChange("TakeResult", op.job_id);
  statements_->take_attempt.Run(op.job_id, op.source_job_id, op.token, op.at_us);
  RequireOneChange("TakeResult", op.job_id);
  statements_->take_result.Run(op.job_id, op.source_job_id, op.at_us);
  RequireOneChange("TakeResult", op.job_id);
  statements_->take_waypoints.Run(op.job_id, op.source_job_id);
  statements_->take_unsolved.Run(op.job_id, op.source_job_id);
  statements_->take_violations.Run(op.job_id, op.source_job_id);
  statements_->end_attempt.Run(op.job_id, kAttempt, AttemptOutcome::kFinished, 0,
                               "reused from job " + std::to_string(op.source_job_id), "", op.at_us);
  RequireOneChange("TakeResult", op.job_id);
  EndJob(op.job_id, kAttempt, JobState::kDone, false);
}

void SqliteStore::Do(const RecordStaleResult& op) {
  Statement& s = statements_->insert_stale;
  s.BindAll(op.job_id, op.attempt, op.outcome, op.reason, op.message, op.at_us);
  if (op.result) {
    const ResultRecord& r = *op.result;
    s.Bind(7, r.waypoint_size).BindBlob(8, r.waypoints.data(), r.waypoints.size() * sizeof(double));
    sql::Bind(s, sql::kFirstOfStale, sql::Columns::kStale, r);
  }
  s.RunBound();
}

void SqliteStore::Do(const CancelExperiment& op) {
  statements_->cancel_attempts.Run(op.experiment_id, op.at_us);
  statements_->cancel_jobs.Run(op.experiment_id);
  statements_->close_experiment.Run(op.experiment_id, ExperimentState::kCancelled, op.at_us);
  RequireOneChange("CancelExperiment", op.experiment_id);
}

void SqliteStore::Do(const ControlExperiment& op) {
  statements_->control_experiment.Run(op.experiment_id, op.control.hold, op.control.reason, op.control.priority,
                                      op.control.builds, op.control.build_id);
  RequireOneChange("ControlExperiment", op.experiment_id);
}

void SqliteStore::Do(const FinishExperiment& op) {
  statements_->close_experiment.Run(op.experiment_id, ExperimentState::kDone, op.at_us);
  RequireOneChange("FinishExperiment", op.experiment_id);
}

void SqliteStore::Do(const PutWorker& op) {
  const WorkerRecord& w = op.worker;
  statements_->put_worker.Run(w.worker_id, w.endpoint, w.name, w.hostname, w.pid, w.slots, w.build, w.seen_at_us,
                              w.build_id, w.processor, w.processors, w.memory_bytes, w.load);
}

void SqliteStore::Do(const StoreDataset& op) {
  Statement insert(connection_, sql::kInsertArchive, false);
  insert.BindAll(op.hash).BindBlob(2, op.archive.data(), op.archive.size()).RunBound();
}

void SqliteStore::Do(const RecordEvent& op) {
  statements_->insert_event.Run(op.kind, op.at_us, op.experiment_id, op.job_id, op.worker_id, op.detail);
}

void SqliteStore::Idle() {
  if (!written_since_checkpoint_) return;
  written_since_checkpoint_ = false;
  // A reader may hold parts of the log back; they are moved when the server is idle next.
  connection_.Execute("PRAGMA wal_checkpoint(PASSIVE)");
}

// Handles a database file that is no longer at its path: all acknowledged data is still reachable through the open
// file, and is saved to a place where users find it before the process ends.

namespace {

using Place = DatabaseFile::Place;

std::string TimeStamp() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof(text), "%Y%m%dT%H%M%SZ", &utc);
  return text;
}

}  // namespace

void SqliteStore::CheckPlace() {
  const Place place = file_.Look();
  if (place != Place::kThere) ThrowDisplaced(place, Rescue(place));
  rescued_to_.clear();
}

void SqliteStore::ThrowDisplaced(Place place, const std::string& remedy) const {
  throw StoreError(StoreErrorCode::kDisplaced, file_.path().string() + ": " + file_.Describe(place) +
                                                   " while the server works on it" +
                                                   (remedy.empty() ? "" : "; " + remedy));
}

// Moves the whole log into the file, which was renamed or unlinked. Returns false if some of the log remains.
bool SqliteStore::CheckpointAll() {
  try {
    connection_.SetBusyTimeout(std::chrono::milliseconds(0));  // a reader must not block the server
    const bool all = connection_.QueryInt("PRAGMA wal_checkpoint(TRUNCATE)") == 0;
    connection_.SetBusyTimeout(Connection::kBusyTimeout);
    return all;
  } catch (const StoreError&) {
    connection_.SetBusyTimeout(Connection::kBusyTimeout);
    return false;
  }
}

// Saves all acknowledged data; returns a message with its location and what to do.
std::string SqliteStore::Rescue(Place place) {
  const bool whole = CheckpointAll();
  if (place == Place::kSideFile) {
    return whole ? "the database holds all acknowledged results; stop the server and start it again"
                 : "do not stop the server yet: its log is still being written into the database";
  }
  if (place == Place::kElsewhere) {
    return whole ? "it holds all acknowledged results; move it back and the server continues, or stop the server"
                 : "do not stop the server yet: its log is still being written into that file";
  }
  try {
    if (rescued_to_.empty()) {
      const std::filesystem::path copy = file_.path().string() + ".rescued-" + TimeStamp();
      BackUp(connection_, copy);
      rescued_to_ = copy;
    }
    return "all that was acknowledged was copied to " + rescued_to_.string() +
           "; stop the server, give the copy its old name and start the server again";
  } catch (const StoreError& error) {
    return std::string("it could not be copied (") + error.what() + "); before the server is stopped, " +
           (whole ? "save all that was acknowledged by 'cp " + file_.DescriptorPath() + " COPY'"
                  : "make room: its log is not in one file yet");
  }
}

}  // namespace legopt::db
