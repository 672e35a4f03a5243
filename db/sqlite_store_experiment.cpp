#include <array>
#include <string>
#include <vector>

#include "db/sqlite_statements.h"
#include "db/sqlite_store_impl.h"

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

}  // namespace

std::int64_t SqliteStore::PutDataset(const DatasetRecord& dataset) {
  statements_->put_dataset.Run(dataset.hash, dataset.name);
  return FindId(statements_->find_dataset.BindAll(dataset.hash));
}

std::int64_t SqliteStore::PutMethod(const MethodRecord& method) {
  statements_->put_method.Run(method.hash, method.name, method.options_json, method.multi_starts,
                              method.sample_size_percent, method.incremental ? 1 : 0, method.collision);
  return FindId(statements_->find_method.BindAll(method.hash, method.name));
}

std::int64_t SqliteStore::PutProblem(std::int64_t dataset_id, const ProblemRecord& problem) {
  statements_->put_problem.Run(dataset_id, problem.task, problem.number, problem.waypoints);
  return FindId(statements_->find_problem.BindAll(dataset_id, problem.task, problem.number));
}

void SqliteStore::Do(const CreateExperiment& op) {
  const NewExperiment& e = op.experiment;
  if (e.jobs.empty()) ThrowIllegal("no jobs");
  const std::int64_t dataset_id = PutDataset(e.dataset);
  std::vector<std::int64_t> method_ids;
  for (const MethodRecord& method : e.methods) method_ids.push_back(PutMethod(method));
  std::vector<std::int64_t> problem_keys;
  for (const ProblemRecord& problem : e.problems) problem_keys.push_back(PutProblem(dataset_id, problem));
  const std::int64_t first_job_id = e.jobs.front().job_id;
  statements_->insert_experiment.Run(e.experiment_id, e.submission_id, e.name, dataset_id, e.seed, e.repetitions,
                                     e.max_attempts, e.wall_limit_us, e.memory_limit_bytes, first_job_id,
                                     static_cast<std::int64_t>(e.jobs.size()), e.spec_json, e.spec_hash,
                                     e.submitted_at_us);
  for (const CellRecord& cell : e.cells) {
    statements_->insert_cell.Run(cell.cell_id, e.experiment_id, At(method_ids, cell.method_index, "method"), cell.task,
                                 cell.initialization, cell.num_jobs,
                                 cell.wall_limit_us > 0 ? cell.wall_limit_us : e.wall_limit_us);
  }
  InsertJobs(e, problem_keys);
}

// Sixty-four rows per statement take half the time of as many statements, and everybody waits for a submission.
void SqliteStore::InsertJobs(const NewExperiment& e, std::span<const std::int64_t> problem_keys) {
  std::size_t done = 0;
  const auto insert = [&](Statement& statement, std::size_t count) {
    int parameter = 0;
    for (const NewJob& job : std::span(e.jobs).subspan(done, count)) {
      RequireLegal(e, job);
      const std::int64_t cell_id = e.cells[static_cast<std::size_t>(job.cell_index)].cell_id;
      const std::int64_t problem_key = problem_keys[static_cast<std::size_t>(job.problem_index)];
      const std::array<std::int64_t, sql::kValuesPerJob> row = {job.job_id, cell_id, problem_key, job.repetition,
                                                                e.max_attempts};
      for (const std::int64_t value : row) statement.Bind(++parameter, value);
    }
    statement.RunBound();
    done += count;
  };
  while (e.jobs.size() - done >= sql::kJobsPerBatch) insert(statements_->insert_job_batch, sql::kJobsPerBatch);
  while (done < e.jobs.size()) insert(statements_->insert_job, 1);
}

}  // namespace legopt::db
