#include "tests/doubles/memory_store_tables.h"

#include <algorithm>
#include <cstdlib>

#include "legopt/math/blake2b.h"

namespace legopt::db {

void RequireLegal(bool legal, const std::string& message) {
  if (!legal) throw StoreError(StoreErrorCode::kConstraint, "memory store: " + message);
}

void MemoryStore::Tables::Do(const CreateExperiment& op) {
  const NewExperiment& e = op.experiment;
  RequireLegal(!e.jobs.empty() && e.experiment_id > 0 && !e.submission_id.empty() && ValidateName(e.name).empty() &&
                   e.submitter.size() <= kMaxNameBytes,
               "bad experiment");
  RequireLegal(IsBlake2bHex(e.spec_hash) && IsBlake2bHex(e.dataset.hash), "bad hash");
  RequireLegal(
      e.seed >= 0 && e.repetitions >= 1 && e.max_attempts >= 1 && e.wall_limit_us > 0 && e.memory_limit_bytes > 0,
      "number out of range");
  InsertKey(submissions, e.submission_id, "submission");
  MemoryExperiment row;
  row.summary.experiment_id = e.experiment_id;
  row.summary.submission_id = e.submission_id;
  row.summary.name = e.name;
  row.summary.spec_hash = e.spec_hash;
  row.summary.first_job_id = e.jobs.front().job_id;
  row.summary.num_jobs = static_cast<std::int64_t>(e.jobs.size());
  row.summary.submitted_at_us = e.submitted_at_us;
  row.summary.submitter = e.submitter;
  row.summary.control.builds = e.builds;
  row.summary.rule = e.rule;
  const auto [dataset, is_new] = dataset_names.emplace(e.dataset.hash, e.dataset.name);
  if (is_new) undo.push_back([this, hash = e.dataset.hash] { dataset_names.erase(hash); });
  row.summary.dataset = dataset->second;  // identical content under another name is the same dataset
  for (const CellRecord& cell : e.cells) {
    const std::string& name = e.methods.at(static_cast<std::size_t>(cell.method_index)).name;
    std::vector<std::string>& names = row.summary.methods;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  row.spec_json = e.spec_json;
  row.dataset_hash = e.dataset.hash;
  row.num_cells = e.cells.size();
  Insert(experiments, e.experiment_id, row, "experiment");
  for (const MethodRecord& method : e.methods) {
    RequireLegal(IsBlake2bHex(method.hash) && method.sample_size_percent >= 1 && method.multi_starts >= 0,
                 "bad method");
    if (options.emplace(method.hash, method.options_json).second) {
      undo.push_back([this, hash = method.hash] { options.erase(hash); });
    }
  }
  for (const CellRecord& cell : e.cells) {
    Insert(cells, cell.cell_id, e.experiment_id, "cell");
  }
  std::int64_t expected_id = e.jobs.front().job_id;
  std::set<std::pair<std::pair<int, int>, int>> keys;
  for (const NewJob& job : e.jobs) {
    RequireLegal(job.job_id == expected_id++, "job ids are not consecutive");
    const CellRecord& cell = e.cells.at(static_cast<std::size_t>(job.cell_index));
    RequireLegal(e.problems.at(static_cast<std::size_t>(job.problem_index)).task == cell.task, "tasks differ");
    RequireLegal(keys.insert({{job.cell_index, job.problem_index}, job.repetition}).second, "job exists already");
    MemoryJob job_row;
    job_row.experiment_id = e.experiment_id;
    job_row.cell = static_cast<std::size_t>(job.cell_index);
    job_row.max_attempts = e.max_attempts;
    job_row.key = {e.dataset.hash,
                   e.methods.at(static_cast<std::size_t>(cell.method_index)).hash,
                   e.seed,
                   cell.effort_limit,
                   cell.task,
                   cell.initialization,
                   e.problems.at(static_cast<std::size_t>(job.problem_index)).number,
                   job.repetition};
    Insert(jobs, job.job_id, job_row, "job");
    InsertKey(jobs_by_key, std::pair{job_row.key, job.job_id}, "key of a job");
  }
}

void MemoryStore::Tables::Do(const LeaseJob& op) {
  MemoryJob& job = JobOf(op.job_id);
  const int charged = op.attempt - job.returned;
  RequireLegal(job.state == JobState::kQueued && op.attempt == static_cast<int>(job.attempts.size()) + 1 &&
                   op.token > 0 && charged <= job.max_attempts,
               "job " + std::to_string(op.job_id) + " cannot be leased");
  RequireLegal(workers.contains(op.worker_id), "no worker " + std::to_string(op.worker_id));
  Set(job.state, JobState::kLeased);
  job.attempts.push_back({op.token, op.worker_id, AttemptOutcome::kRunning, op.at_us});
  undo.push_back([&job] { job.attempts.pop_back(); });
}

void MemoryStore::Tables::Do(const EndAttempt& op) {
  RequireLegal(op.next != JobState::kLeased && op.next != JobState::kDone && op.outcome != AttemptOutcome::kRunning &&
                   op.outcome != AttemptOutcome::kFinished,
               "bad end of attempt");
  MemoryAttempt& attempt = RunningAttempt(op.job_id, op.attempt);
  MemoryJob& job = JobOf(op.job_id);
  Set(attempt.outcome, op.outcome);
  Set(attempt.ended_at_us, op.at_us);
  Set(job.state, op.next);
  if (op.outcome == AttemptOutcome::kReturned) Set(job.returned, job.returned + 1);
}

void MemoryStore::Tables::Do(const AcceptResult& op) {
  MemoryAttempt& attempt = RunningAttempt(op.job_id, op.attempt);
  RequireLegal(FaultOf(op.result).empty(), FaultOf(op.result));
  Insert(results, op.job_id, Accepted{op.job_id, op.attempt, op.result}, "result");
  Set(attempt.outcome, AttemptOutcome::kFinished);
  Set(attempt.ended_at_us, op.at_us);
  Set(JobOf(op.job_id).state, JobState::kDone);
}

void MemoryStore::Tables::Do(const ReuseResult& op) {
  MemoryJob& job = JobOf(op.job_id);
  const MemoryJob& source = JobOf(op.source_job_id);
  const auto result = results.find(op.source_job_id);
  RequireLegal(job.state == JobState::kQueued && job.attempts.empty() && op.source_job_id != op.job_id &&
                   result != results.end() && op.token > 0,
               "job " + std::to_string(op.job_id) + " cannot take the result of " + std::to_string(op.source_job_id));
  const std::int64_t worker = source.attempts.at(static_cast<std::size_t>(result->second.attempt) - 1).worker_id;
  Set(job.taken_from, source.taken_from > 0 ? source.taken_from : op.source_job_id);
  job.attempts.push_back({op.token, worker, AttemptOutcome::kFinished, op.at_us, op.at_us});
  undo.push_back([&job] { job.attempts.pop_back(); });
  Insert(results, op.job_id, Accepted{op.job_id, 1, result->second.result}, "result");
  Set(job.state, JobState::kDone);
}

void MemoryStore::Tables::Do(const RecordStaleResult& op) {
  const MemoryJob& job = JobOf(op.job_id);
  RequireLegal(op.attempt >= 1 && op.attempt <= static_cast<int>(job.attempts.size()), "stale result of no attempt");
  RequireLegal(!op.reason.empty() && (op.outcome == AttemptOutcome::kFinished) == op.result.has_value(),
               "bad stale result");
  if (!stale.contains({op.job_id, op.attempt})) InsertKey(stale, std::pair{op.job_id, op.attempt}, "stale result");
}

void MemoryStore::Tables::Close(std::int64_t experiment_id, ExperimentState state, std::int64_t at_us) {
  const auto row = experiments.find(experiment_id);
  RequireLegal(row != experiments.end() && row->second.summary.state == ExperimentState::kActive,
               "experiment is not active");
  Set(row->second.summary.state, state);
  Set(row->second.summary.finished_at_us, at_us);
  ExperimentControl control = row->second.summary.control;
  control.hold = ExperimentHold::kNone;
  control.reason.clear();
  Set(row->second.summary.control, std::move(control));
}

void MemoryStore::Tables::Do(const CancelExperiment& op) {
  for (auto& [job_id, job] : jobs) {
    if (job.experiment_id != op.experiment_id || IsTerminal(job.state)) continue;
    if (job.state == JobState::kLeased) {
      Set(job.attempts.back().outcome, AttemptOutcome::kCancelled);
      Set(job.attempts.back().ended_at_us, op.at_us);
    }
    Set(job.state, JobState::kCancelled);
  }
  Close(op.experiment_id, ExperimentState::kCancelled, op.at_us);
}

void MemoryStore::Tables::Do(const ControlExperiment& op) {
  const auto row = experiments.find(op.experiment_id);
  RequireLegal(row != experiments.end() && row->second.summary.state == ExperimentState::kActive,
               "experiment is not active");
  RequireLegal((op.control.hold == ExperimentHold::kPaused || op.control.reason.empty()) &&
                   std::abs(op.control.priority) <= kMaxPriority && op.control.build_id.size() <= kMaxBuildIdBytes,
               "bad control");
  Set(row->second.summary.control, op.control);
}

bool MemoryStore::Tables::MayRetry(std::int64_t job_id, const MemoryJob& job, bool time_limited) const {
  if (job.state == JobState::kFailed || job.state == JobState::kDead) return true;
  return time_limited && job.state == JobState::kDone &&
         results.at(job_id).result.solver_status == SolveStatus::kTimeLimit;
}

void MemoryStore::Tables::Do(const RetryExperiment& op) {
  const auto row = experiments.find(op.experiment_id);
  RequireLegal(row != experiments.end() && row->second.summary.state != ExperimentState::kCancelled,
               "experiment cannot be retried");
  bool any = false;
  for (auto& [job_id, job] : jobs) {
    if (job.experiment_id != op.experiment_id || !MayRetry(job_id, job, op.time_limited)) continue;
    if (job.state == JobState::kDone) {
      const std::pair attempt{job_id, results.at(job_id).attempt};
      if (!stale.contains(attempt)) InsertKey(stale, attempt, "stale result");
      Erase(results, job_id);
    }
    Set(job.state, JobState::kQueued);
    Set(job.returned, static_cast<int>(job.attempts.size()));
    any = true;
  }
  RequireLegal(any, "no job to retry");
  Set(row->second.summary.state, ExperimentState::kActive);
  Set(row->second.summary.finished_at_us, std::int64_t{0});
}

MemoryExperiment& MemoryStore::Tables::ExperimentOf(std::int64_t experiment_id) {
  const auto row = experiments.find(experiment_id);
  RequireLegal(row != experiments.end(), "no experiment " + std::to_string(experiment_id));
  return row->second;
}

void MemoryStore::Tables::Do(const DeleteExperiment& op) {
  const ExperimentSummary& summary = ExperimentOf(op.experiment_id).summary;
  RequireLegal(summary.state != ExperimentState::kActive, "experiment is not closed");
  Set(deleted_experiment, experiments.rbegin()->first);
  Set(deleted_job, jobs.rbegin()->first);
  Set(deleted_cell, cells.rbegin()->first);
  for (std::int64_t job = summary.first_job_id; job < summary.first_job_id + summary.num_jobs; ++job) {
    for (int attempt = 1; attempt <= static_cast<int>(jobs.at(job).attempts.size()); ++attempt) {
      const std::pair key{job, attempt};
      if (stale.erase(key) > 0) undo.push_back([this, key] { stale.insert(key); });
    }
    Erase(results, job);
    Erase(jobs_by_key, std::pair{jobs.at(job).key, job});
    Erase(jobs, job);
  }
  std::vector<std::int64_t> its_cells;
  for (const auto& [cell, experiment] : cells) {
    if (experiment == op.experiment_id) its_cells.push_back(cell);
  }
  for (const std::int64_t cell : its_cells) Erase(cells, cell);
  submissions.erase(summary.submission_id);
  undo.push_back([this, id = summary.submission_id] { submissions.insert(id); });
  const std::string dataset = ExperimentOf(op.experiment_id).dataset_hash;
  Erase(experiments, op.experiment_id);
  if (archives.contains(dataset) && !HasExperimentOn(dataset)) Erase(archives, dataset);
}

void MemoryStore::Tables::Do(const RenameExperiment& op) {
  RequireLegal(ValidateName(op.name).empty(), "bad name");
  Set(ExperimentOf(op.experiment_id).summary.name, op.name);
}

void MemoryStore::Tables::Do(const TagExperiment& op) {
  RequireLegal(ValidateTag(op.tag).empty(), "bad tag");
  std::set<std::string>& tags = ExperimentOf(op.experiment_id).summary.tags;
  std::set<std::string> next = tags;
  if (op.set) {
    next.insert(op.tag);
  } else {
    next.erase(op.tag);
  }
  Set(tags, std::move(next));
}

void MemoryStore::Tables::Do(const FinishExperiment& op) {
  for (const auto& [job_id, job] : jobs) {
    RequireLegal(job.experiment_id != op.experiment_id || IsTerminal(job.state), "experiment has open jobs");
  }
  Close(op.experiment_id, ExperimentState::kDone, op.at_us);
}

void MemoryStore::Tables::Do(const PutWorker& op) {
  RequireLegal(op.worker.worker_id > 0 && op.worker.endpoint > 0 && op.worker.slots >= 1 && op.worker.pid >= 0,
               "bad worker");
  const auto known = workers.find(op.worker.worker_id);
  if (known == workers.end()) {
    InsertKey(endpoints, op.worker.endpoint, "endpoint");
    Insert(workers, op.worker.worker_id, op.worker, "worker");
  } else {
    RequireLegal(known->second.endpoint == op.worker.endpoint, "a worker keeps its endpoint");
    Set(known->second, op.worker);
  }
}

void MemoryStore::Tables::Do(const StoreDataset& op) {
  RequireLegal(!op.archive.empty(), "empty archive");
  if (dataset_names.contains(op.hash) && !archives.contains(op.hash)) Insert(archives, op.hash, op.archive, "archive");
}

void MemoryStore::Tables::Do(const RecordEvent& op) {
  RequireLegal(!op.kind.empty() && op.kind.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") == std::string::npos,
               "bad event");
  RequireLegal(!op.experiment_id || experiments.contains(*op.experiment_id), "event of an unknown experiment");
  RequireLegal(!op.job_id || jobs.contains(*op.job_id), "event of an unknown job");
  RequireLegal(!op.worker_id || workers.contains(*op.worker_id), "event of an unknown worker");
  Set(events, events + 1);
}

ExperimentSummary MemoryStore::Tables::Summarize(const MemoryExperiment& row) const {
  ExperimentSummary summary = row.summary;
  for (std::int64_t id = summary.first_job_id; id < summary.first_job_id + summary.num_jobs; ++id) {
    ++summary.jobs_by_state[jobs.at(id).state];
    summary.taken_over += jobs.at(id).taken_from > 0 ? 1 : 0;
    const auto result = results.find(id);
    if (result != results.end() && result->second.result.SolvedBy(summary.rule)) ++summary.solved;
  }
  return summary;
}

// Same rules as the view reusable_results.
KnownResult MemoryStore::Tables::Known(const ResultSearch& search, const ResultSearch::Problem& problem) const {
  const JobKey key{search.dataset_hash, search.method_hash,    search.seed,    search.effort_limit,
                   search.task,         search.initialization, problem.number, problem.repetition};
  for (auto at = jobs_by_key.lower_bound({key, 0}); at != jobs_by_key.end() && at->first == key; ++at) {
    const MemoryJob& job = jobs.at(at->second);
    const auto found = results.find(at->second);
    if (job.experiment_id == search.experiment_id || found == results.end()) continue;
    const auto& [job_id, attempt, result] = found->second;
    const std::string& build = workers.at(job.attempts.at(static_cast<std::size_t>(attempt) - 1).worker_id).build_id;
    const SolveStatus status = result.solver_status;
    const bool ended_itself =
        status != SolveStatus::kNotRun && status != SolveStatus::kTimeLimit && status != SolveStatus::kCancelled;
    const bool within = result.wall_us <= search.wall_limit_us && result.peak_memory_bytes <= search.memory_limit_bytes;
    if (!ended_itself || !within || build.empty() || (search.build_id && *search.build_id != build)) continue;
    return {job_id, result.wall_us, result.SolvedBy(search.rule)};
  }
  return {};
}

OpenExperiment MemoryStore::Tables::Open(const MemoryExperiment& row) const {
  OpenExperiment open;
  open.experiment_id = row.summary.experiment_id;
  open.spec_json = row.spec_json;
  open.cell_times.resize(row.num_cells);
  for (std::int64_t id = row.summary.first_job_id; id < row.summary.first_job_id + row.summary.num_jobs; ++id) {
    const MemoryJob& job = jobs.at(id);
    OpenJob& open_job = open.jobs.emplace_back();
    open_job.state = job.state;
    open_job.attempts = static_cast<int>(job.attempts.size());
    open_job.returned = job.returned;
    if (job.attempts.empty()) continue;
    open_job.token = job.attempts.back().token;
    open_job.worker_id = job.attempts.back().worker_id;
    open_job.outcome = job.attempts.back().outcome;
    open_job.leased_at_us = job.attempts.back().leased_at_us;
    open_job.ended_at_us = job.attempts.back().ended_at_us;
    const auto result = results.find(id);
    if (result == results.end()) continue;
    open_job.time_limited = result->second.result.solver_status == SolveStatus::kTimeLimit;
    open_job.solved = result->second.result.SolvedBy(row.summary.rule);
    open.cell_times[job.cell].wall_us += result->second.result.wall_us;
    open.cell_times[job.cell].waypoints += result->second.result.num_waypoints;
  }
  return open;
}

}  // namespace legopt::db
