// Changes that users make to submitted experiments. They are rare, so the statements are prepared when needed.
#include <string>
#include <utility>
#include <vector>

#include "db/sqlite_statements.h"
#include "db/sqlite_store_impl.h"

namespace legopt::db {
namespace {

[[noreturn]] void ThrowIllegal(const char* operation, std::int64_t experiment_id, const std::string& what) {
  throw StoreError(StoreErrorCode::kConstraint, std::string(operation) + ": experiment " +
                                                    std::to_string(experiment_id) + " " + what +
                                                    "; this is a defect of legopt");
}

// Allows deleting rows before the rows that refer to them; foreign keys are checked at the end of the transaction.
void DeferForeignKeys(Connection& connection) { connection.Execute("PRAGMA defer_foreign_keys = ON"); }

}  // namespace

// Moves results of solves that hit the wall-time limit to the stale results and re-queues their jobs. Returns their
// number.
std::int64_t SqliteStore::RequeueTimeLimited(const RetryExperiment& op) {
  std::vector<std::int64_t> jobs;
  Statement find(connection_, sql::kTimeLimitedResults, false);
  for (find.BindAll(op.experiment_id); find.Step();) jobs.push_back(find.column_int(0));
  DeferForeignKeys(connection_);
  Statement read(connection_, sql::kReadWaypoints), keep(connection_, sql::KeepResultAsStale());
  Statement drop_result(connection_, sql::kDropResult), drop_waypoints(connection_, sql::kDropWaypoints);
  Statement drop_unsolved(connection_, sql::kDropUnsolved), drop_violations(connection_, sql::kDropViolations);
  Statement requeue(connection_, sql::kRequeueDone);
  for (const std::int64_t job : jobs) {
    std::string x;
    std::size_t row_bytes = 0;
    for (read.BindAll(job); read.Step(); x += read.column_text(0)) row_bytes = read.column_text(0).size();
    read.Reset();
    keep.BindAll(job, op.at_us, static_cast<std::int64_t>(row_bytes / sizeof(double)));
    keep.BindBlob(4, x.data(), x.size()).RunBound();
    drop_result.Run(job);
    drop_waypoints.Run(job);
    drop_unsolved.Run(job);
    drop_violations.Run(job);
    requeue.Run(job);
    RequireOneChange("RetryExperiment", job);
  }
  return static_cast<std::int64_t>(jobs.size());
}

void SqliteStore::Do(const RetryExperiment& op) {
  statements_->retry_jobs.Run(op.experiment_id);
  std::int64_t queued = connection_.changes();
  if (op.time_limited) queued += RequeueTimeLimited(op);
  if (queued == 0) ThrowIllegal("RetryExperiment", op.experiment_id, "has no job to retry");
  statements_->reopen_experiment.Run(op.experiment_id);
  RequireOneChange("RetryExperiment", op.experiment_id);
}

void SqliteStore::Do(const DeleteExperiment& op) {
  Statement find(connection_, sql::kJobsOfClosed, false);
  if (!find.BindAll(op.experiment_id).Step()) ThrowIllegal("DeleteExperiment", op.experiment_id, "is not closed");
  const std::int64_t first_job = find.column_int(0), end_job = find.column_int(1);
  find.Reset();
  DeferForeignKeys(connection_);
  Statement(connection_, sql::kRememberDeletedIds, false).Run();
  // Delete the experiment first: the schema forbids deleting rows of an existing experiment.
  Statement(connection_, sql::kDeleteExperiment, false).Run(op.experiment_id);
  for (const char* statement : sql::kDeleteOfJobs) Statement(connection_, statement, false).Run(first_job, end_job);
  for (const char* statement : sql::kDeleteOfExperiment) Statement(connection_, statement, false).Run(op.experiment_id);
}

void SqliteStore::Do(const RenameExperiment& op) {
  if (const std::string fault = ValidateName(op.name); !fault.empty()) {
    ThrowIllegal("RenameExperiment", op.experiment_id, "name " + fault);
  }
  Statement(connection_, sql::kRenameExperiment, false).Run(op.experiment_id, op.name);
  RequireOneChange("RenameExperiment", op.experiment_id);
}

void SqliteStore::Do(const TagExperiment& op) {
  if (const std::string fault = ValidateTag(op.tag); !fault.empty()) {
    ThrowIllegal("TagExperiment", op.experiment_id, "tag " + fault);
  }
  Statement known(connection_, "SELECT 1 FROM experiments WHERE experiment_id = ?1", false);
  if (!known.BindAll(op.experiment_id).Step()) ThrowIllegal("TagExperiment", op.experiment_id, "does not exist");
  Statement(connection_, op.set ? sql::kSetTag : sql::kDropTag, false).Run(op.experiment_id, op.tag);
}

}  // namespace legopt::db
