#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>
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

}  // namespace legopt::db
