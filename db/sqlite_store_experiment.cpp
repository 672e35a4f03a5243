#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "db/sqlite_statements.h"
#include "db/sqlite_store_impl.h"
#include "legopt/input/json.h"

namespace legopt::db {
namespace {

std::int64_t FindId(Statement& find) {
  const bool found = find.Step();
  const std::int64_t id = found ? find.column_int(0) : 0;
  find.Reset();
  return id;
}

[[noreturn]] void ThrowIllegal(const std::string& message) {
  throw StoreError(StoreErrorCode::kConstraint, "CreateExperiment: " + message + "; this is a defect of legopt");
}

template <class Item>
const Item& At(const std::vector<Item>& items, int index, const char* what) {
  if (index < 0 || static_cast<std::size_t>(index) >= items.size()) {
    ThrowIllegal(std::string(what) + " index " + std::to_string(index) + " is out of range");
  }
  return items[static_cast<std::size_t>(index)];
}

void RequireLegal(const NewExperiment& experiment, const NewJob& job) {
  const auto place = &job - experiment.jobs.data();
  if (job.job_id != experiment.jobs.front().job_id + place) ThrowIllegal("job ids are not consecutive");
  const CellRecord& cell = At(experiment.cells, job.cell_index, "cell");
  if (At(experiment.problems, job.problem_index, "problem").task != cell.task) {
    ThrowIllegal("job " + std::to_string(job.job_id) + " joins a cell and a problem of different tasks");
  }
}

// problem_key by task and problem number
using ProblemKeys = EnumArray<Task, std::unordered_map<std::int64_t, std::int64_t>>;

ProblemKeys ReadProblemKeys(Statement& find, std::int64_t dataset_id) {
  ProblemKeys keys;
  find.BindAll(dataset_id);
  while (find.Step()) keys[find.column_enum<Task>(0)].emplace(find.column_int(1), find.column_int(2));
  find.Reset();
  return keys;
}

// Inserts `count` rows with the multi-row statement `batch` and the remaining ones with `single`. `bind` binds row i
// starting at a parameter number and returns the number of bound values.
template <class Bind>
void InBatches(Statement& batch, Statement& single, std::size_t count, const Bind& bind) {
  for (std::size_t done = 0; done < count;) {
    const bool many = count - done >= sql::kRowsPerBatch;
    Statement& statement = many ? batch : single;
    const std::size_t end = done + (many ? sql::kRowsPerBatch : 1);
    for (int parameter = 1; done < end; ++done) parameter += bind(statement, parameter, done);
    statement.RunBound();
  }
}

}  // namespace

std::int64_t SqliteStore::PutDataset(const DatasetRecord& dataset) {
  // Names that are not valid UTF-8 belong to a dataset that cannot be loaded; they must not crash the server.
  const std::string joints = Dump(nlohmann::json(dataset.joint_names));
  statements_->put_dataset.Run(dataset.hash, dataset.name, dataset.joint_names.empty() ? "" : joints);
  return FindId(statements_->find_dataset.BindAll(dataset.hash));
}

std::int64_t SqliteStore::PutMethod(const MethodRecord& method) {
  statements_->put_method.Run(method.hash, method.name, method.options_json, method.multi_starts,
                              method.sample_size_percent, method.incremental ? 1 : 0, method.collision);
  return FindId(statements_->find_method.BindAll(method.hash, method.name));
}

// Returns the keys of the problems, in their order, after inserting the missing ones.
std::vector<std::int64_t> SqliteStore::PutProblems(std::int64_t dataset_id, std::span<const ProblemRecord> problems) {
  ProblemKeys keys = ReadProblemKeys(statements_->find_problems, dataset_id);
  std::vector<const ProblemRecord*> fresh;
  for (const ProblemRecord& problem : problems) {
    if (keys[problem.task].count(problem.number) == 0) fresh.push_back(&problem);
  }
  InBatches(statements_->insert_problem_batch, statements_->insert_problem, fresh.size(),
            [&](Statement& statement, int parameter, std::size_t i) {
              statement.Bind(parameter, dataset_id);
              statement.Bind(parameter + 1, fresh[i]->task);
              statement.Bind(parameter + 2, fresh[i]->number);
              statement.Bind(parameter + 3, fresh[i]->waypoints);
              return 4;
            });
  if (!fresh.empty()) keys = ReadProblemKeys(statements_->find_problems, dataset_id);
  std::vector<std::int64_t> found;
  for (const ProblemRecord& problem : problems) found.push_back(keys[problem.task].at(problem.number));
  return found;
}

void SqliteStore::Do(const CreateExperiment& op) {
  const NewExperiment& e = op.experiment;
  if (e.jobs.empty()) ThrowIllegal("no jobs");
  const std::int64_t dataset_id = PutDataset(e.dataset);
  std::vector<std::int64_t> method_ids;
  for (const MethodRecord& method : e.methods) method_ids.push_back(PutMethod(method));
  const std::vector<std::int64_t> problem_keys = PutProblems(dataset_id, e.problems);
  const std::int64_t first_job_id = e.jobs.front().job_id;
  statements_->insert_experiment.Run(e.experiment_id, e.submission_id, e.name, dataset_id, e.seed, e.repetitions,
                                     e.max_attempts, e.wall_limit_us, e.memory_limit_bytes, first_job_id,
                                     static_cast<std::int64_t>(e.jobs.size()), e.spec_json, e.spec_hash,
                                     e.submitted_at_us, e.submitter, e.builds, e.rule);
  for (const CellRecord& cell : e.cells) {
    statements_->insert_cell.Run(cell.cell_id, e.experiment_id, At(method_ids, cell.method_index, "method"), cell.task,
                                 cell.initialization, cell.num_jobs,
                                 cell.wall_limit_us > 0 ? cell.wall_limit_us : e.wall_limit_us, cell.effort_limit);
  }
  InsertJobs(e, problem_keys);
}

void SqliteStore::InsertJobs(const NewExperiment& e, std::span<const std::int64_t> problem_keys) {
  InBatches(statements_->insert_job_batch, statements_->insert_job, e.jobs.size(),
            [&](Statement& statement, int parameter, std::size_t i) {
              const NewJob& job = e.jobs[i];
              RequireLegal(e, job);
              statement.Bind(parameter, job.job_id);
              statement.Bind(parameter + 1, e.cells[static_cast<std::size_t>(job.cell_index)].cell_id);
              statement.Bind(parameter + 2, problem_keys[static_cast<std::size_t>(job.problem_index)]);
              statement.Bind(parameter + 3, job.repetition);
              statement.Bind(parameter + 4, e.max_attempts);
              return 5;
            });
}

// Changes that users make to submitted experiments. They are rare, so the statements are prepared when needed.

namespace {

[[noreturn]] void ThrowIllegalChange(const char* operation, std::int64_t experiment_id, const std::string& what) {
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
  if (queued == 0) ThrowIllegalChange("RetryExperiment", op.experiment_id, "has no job to retry");
  statements_->reopen_experiment.Run(op.experiment_id);
  RequireOneChange("RetryExperiment", op.experiment_id);
}

void SqliteStore::Do(const DeleteExperiment& op) {
  Statement find(connection_, sql::kJobsOfClosed, false);
  if (!find.BindAll(op.experiment_id).Step()) ThrowIllegalChange("DeleteExperiment", op.experiment_id, "is not closed");
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
    ThrowIllegalChange("RenameExperiment", op.experiment_id, "name " + fault);
  }
  Statement(connection_, sql::kRenameExperiment, false).Run(op.experiment_id, op.name);
  RequireOneChange("RenameExperiment", op.experiment_id);
}

void SqliteStore::Do(const TagExperiment& op) {
  if (const std::string fault = ValidateTag(op.tag); !fault.empty()) {
    ThrowIllegalChange("TagExperiment", op.experiment_id, "tag " + fault);
  }
  Statement known(connection_, "SELECT 1 FROM experiments WHERE experiment_id = ?1", false);
  if (!known.BindAll(op.experiment_id).Step()) ThrowIllegalChange("TagExperiment", op.experiment_id, "does not exist");
  Statement(connection_, op.set ? sql::kSetTag : sql::kDropTag, false).Run(op.experiment_id, op.tag);
}

}  // namespace legopt::db
