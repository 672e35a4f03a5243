#include "db/memory_store.h"

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <utility>

#include "legopt/blake2b.h"

namespace legopt::db {
namespace {

[[noreturn]] void Refuse(const std::string& message) {
  throw StoreError(StoreErrorCode::kConstraint, "memory store: " + message);
}

void Require(bool legal, const std::string& message) {
  if (!legal) Refuse(message);
}

struct Attempt {
  std::int64_t token = 0;
  std::int64_t worker_id = 0;
  AttemptOutcome outcome = AttemptOutcome::kRunning;
  std::int64_t leased_at_us = 0;
  std::int64_t ended_at_us = 0;  // 0: runs
};

struct JobRow {
  std::int64_t experiment_id = 0;
  std::size_t cell = 0;  // of the experiment's
  JobState state = JobState::kQueued;
  int returned = 0;
  int max_attempts = 1;
  std::deque<Attempt> attempts;  // undo keeps references to its elements
};

struct ExperimentRow {
  ExperimentSummary summary;  // state and times; counts are taken from the jobs
  std::string spec_json;
  std::size_t num_cells = 0;
};

}  // namespace

struct MemoryStore::Tables {
  std::map<std::int64_t, ExperimentRow> experiments;
  std::set<std::string> submissions;
  std::map<std::string, std::string> options;        // by method hash
  std::map<std::string, std::string> dataset_names;  // by hash
  std::map<std::int64_t, JobRow> jobs;
  std::map<std::int64_t, Accepted> results;
  std::set<std::pair<std::int64_t, int>> stale;
  std::map<std::int64_t, WorkerRecord> workers;
  std::set<std::int64_t> endpoints;
  std::map<std::int64_t, std::int64_t> cells;                              // cell -> experiment
  std::int64_t deleted_experiment = 0, deleted_job = 0, deleted_cell = 0;  // largest identifiers that are gone
  std::int64_t events = 0;

  // How to take back what the running Apply has done, latest last.
  std::vector<std::function<void()>> undo;

  // Sets `place` and remembers the old value. Rows live in maps, so their addresses stay.
  template <class T>
  void Set(T& place, T value) {
    undo.push_back([&place, old = place] { place = old; });
    place = std::move(value);
  }
  template <class Map, class Key, class Row>
  auto& Insert(Map& map, const Key& key, Row row, const char* what) {
    const auto [where, inserted] = map.emplace(key, std::move(row));
    Require(inserted, std::string(what) + " exists already");
    undo.push_back([&map, key] { map.erase(key); });
    return where->second;
  }
  // Takes the row out. Should it come back, then at the same address: earlier steps may have kept that.
  template <class Map, class Key>
  void Erase(Map& map, const Key& key) {
    auto node = std::make_shared<typename Map::node_type>(map.extract(key));
    if (!node->empty()) undo.push_back([&map, node] { map.insert(std::move(*node)); });
  }
  template <class Set, class Key>
  void InsertKey(Set& set, const Key& key, const char* what) {
    Require(set.insert(key).second, std::string(what) + " exists already");
    undo.push_back([&set, key] { set.erase(key); });
  }

  JobRow& JobOf(std::int64_t job_id) {
    const auto job = jobs.find(job_id);
    Require(job != jobs.end(), "no job " + std::to_string(job_id));
    return job->second;
  }
  Attempt& RunningAttempt(std::int64_t job_id, int attempt) {
    JobRow& job = JobOf(job_id);
    Require(job.state == JobState::kLeased && attempt == static_cast<int>(job.attempts.size()) &&
                job.attempts.back().outcome == AttemptOutcome::kRunning,
            "job " + std::to_string(job_id) + " does not run attempt " + std::to_string(attempt));
    return job.attempts.back();
  }

  void Do(const CreateExperiment& op);
  void Do(const LeaseJob& op);
  void Do(const EndAttempt& op);
  void Do(const AcceptResult& op);
  void Do(const RecordStaleResult& op);
  void Do(const CancelExperiment& op);
  void Do(const ControlExperiment& op);
  void Do(const RetryExperiment& op);
  void Do(const DeleteExperiment& op);
  void Do(const RenameExperiment& op);
  void Do(const TagExperiment& op);
  void Do(const FinishExperiment& op);
  void Do(const PutWorker& op);
  void Do(const RecordEvent& op);
  void Close(std::int64_t experiment_id, ExperimentState state, std::int64_t at_us);
  bool MayRetry(std::int64_t job_id, const JobRow& job, bool time_limited) const;
  ExperimentRow& ExperimentOf(std::int64_t experiment_id);
  ExperimentSummary Summarize(const ExperimentRow& row) const;
  OpenExperiment Open(const ExperimentRow& row) const;
};

void MemoryStore::Tables::Do(const CreateExperiment& op) {
  const NewExperiment& e = op.experiment;
  Require(!e.jobs.empty() && e.experiment_id > 0 && !e.submission_id.empty() && FaultOfName(e.name).empty() &&
              e.submitter.size() <= kMaxNameBytes,
          "bad experiment");
  Require(IsBlake2bHex(e.spec_hash) && IsBlake2bHex(e.dataset.hash), "bad hash");
  Require(e.seed >= 0 && e.repetitions >= 1 && e.max_attempts >= 1 && e.wall_limit_us > 0 && e.memory_limit_bytes > 0,
          "number out of range");
  InsertKey(submissions, e.submission_id, "submission");
  ExperimentRow row;
  row.summary.experiment_id = e.experiment_id;
  row.summary.submission_id = e.submission_id;
  row.summary.name = e.name;
  row.summary.spec_hash = e.spec_hash;
  row.summary.first_job_id = e.jobs.front().job_id;
  row.summary.num_jobs = static_cast<std::int64_t>(e.jobs.size());
  row.summary.submitted_at_us = e.submitted_at_us;
  row.summary.submitter = e.submitter;
  row.summary.control.builds = e.builds;
  const auto [dataset, is_new] = dataset_names.emplace(e.dataset.hash, e.dataset.name);
  if (is_new) undo.push_back([this, hash = e.dataset.hash] { dataset_names.erase(hash); });
  row.summary.dataset = dataset->second;  // the same content under another name is the same dataset
  for (const CellRecord& cell : e.cells) {
    const std::string& name = e.methods.at(static_cast<std::size_t>(cell.method_index)).name;
    std::vector<std::string>& names = row.summary.methods;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  row.spec_json = e.spec_json;
  row.num_cells = e.cells.size();
  Insert(experiments, e.experiment_id, row, "experiment");
  for (const MethodRecord& method : e.methods) {
    Require(IsBlake2bHex(method.hash) && method.sample_size_percent >= 1 && method.multi_starts >= 0, "bad method");
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
    Require(job.job_id == expected_id++, "job ids are not consecutive");
    const CellRecord& cell = e.cells.at(static_cast<std::size_t>(job.cell_index));
    Require(e.problems.at(static_cast<std::size_t>(job.problem_index)).task == cell.task, "tasks differ");
    Require(keys.insert({{job.cell_index, job.problem_index}, job.repetition}).second, "job exists already");
    JobRow job_row;
    job_row.experiment_id = e.experiment_id;
    job_row.cell = static_cast<std::size_t>(job.cell_index);
    job_row.max_attempts = e.max_attempts;
    Insert(jobs, job.job_id, job_row, "job");
  }
}

void MemoryStore::Tables::Do(const LeaseJob& op) {
  JobRow& job = JobOf(op.job_id);
  const int charged = op.attempt - job.returned;
  Require(job.state == JobState::kQueued && op.attempt == static_cast<int>(job.attempts.size()) + 1 && op.token > 0 &&
              charged <= job.max_attempts,
          "job " + std::to_string(op.job_id) + " cannot be leased");
  Require(workers.contains(op.worker_id), "no worker " + std::to_string(op.worker_id));
  Set(job.state, JobState::kLeased);
  job.attempts.push_back({op.token, op.worker_id, AttemptOutcome::kRunning, op.at_us});
  undo.push_back([&job] { job.attempts.pop_back(); });
}

void MemoryStore::Tables::Do(const EndAttempt& op) {
  Require(op.next != JobState::kLeased && op.next != JobState::kDone && op.outcome != AttemptOutcome::kRunning &&
              op.outcome != AttemptOutcome::kFinished,
          "bad end of attempt");
  Attempt& attempt = RunningAttempt(op.job_id, op.attempt);
  JobRow& job = JobOf(op.job_id);
  Set(attempt.outcome, op.outcome);
  Set(attempt.ended_at_us, op.at_us);
  Set(job.state, op.next);
  if (op.outcome == AttemptOutcome::kReturned) Set(job.returned, job.returned + 1);
}

void MemoryStore::Tables::Do(const AcceptResult& op) {
  Attempt& attempt = RunningAttempt(op.job_id, op.attempt);
  Require(FaultOf(op.result).empty(), FaultOf(op.result));
  Insert(results, op.job_id, Accepted{op.job_id, op.attempt, op.result}, "result");
  Set(attempt.outcome, AttemptOutcome::kFinished);
  Set(attempt.ended_at_us, op.at_us);
  Set(JobOf(op.job_id).state, JobState::kDone);
}

void MemoryStore::Tables::Do(const RecordStaleResult& op) {
  const JobRow& job = JobOf(op.job_id);
  Require(op.attempt >= 1 && op.attempt <= static_cast<int>(job.attempts.size()), "stale result of no attempt");
  Require(!op.reason.empty() && (op.outcome == AttemptOutcome::kFinished) == op.result.has_value(), "bad stale result");
  if (!stale.contains({op.job_id, op.attempt})) InsertKey(stale, std::pair{op.job_id, op.attempt}, "stale result");
}

void MemoryStore::Tables::Close(std::int64_t experiment_id, ExperimentState state, std::int64_t at_us) {
  const auto row = experiments.find(experiment_id);
  Require(row != experiments.end() && row->second.summary.state == ExperimentState::kActive,
          "experiment is not active");
  Set(row->second.summary.state, state);
  Set(row->second.summary.finished_at_us, at_us);
  ExperimentControl control = row->second.summary.control;
  control.hold = Hold::kNone;
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
  Require(row != experiments.end() && row->second.summary.state == ExperimentState::kActive,
          "experiment is not active");
  Require((op.control.hold == Hold::kHeld) == !op.control.reason.empty() &&
              std::abs(op.control.priority) <= kMaxPriority && op.control.build_id.size() <= kMaxBuildIdBytes,
          "bad control");
  Set(row->second.summary.control, op.control);
}

bool MemoryStore::Tables::MayRetry(std::int64_t job_id, const JobRow& job, bool time_limited) const {
  if (job.state == JobState::kFailed || job.state == JobState::kDead) return true;
  return time_limited && job.state == JobState::kDone &&
         results.at(job_id).result.solver_status == SolveStatus::kTimeLimit;
}

void MemoryStore::Tables::Do(const RetryExperiment& op) {
  const auto row = experiments.find(op.experiment_id);
  Require(row != experiments.end() && row->second.summary.state != ExperimentState::kCancelled,
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
  Require(any, "no job to retry");
  Set(row->second.summary.state, ExperimentState::kActive);
  Set(row->second.summary.finished_at_us, std::int64_t{0});
}

ExperimentRow& MemoryStore::Tables::ExperimentOf(std::int64_t experiment_id) {
  const auto row = experiments.find(experiment_id);
  Require(row != experiments.end(), "no experiment " + std::to_string(experiment_id));
  return row->second;
}

void MemoryStore::Tables::Do(const DeleteExperiment& op) {
  const ExperimentSummary& summary = ExperimentOf(op.experiment_id).summary;
  Require(summary.state != ExperimentState::kActive, "experiment is not closed");
  Set(deleted_experiment, experiments.rbegin()->first);
  Set(deleted_job, jobs.rbegin()->first);
  Set(deleted_cell, cells.rbegin()->first);
  for (std::int64_t job = summary.first_job_id; job < summary.first_job_id + summary.num_jobs; ++job) {
    for (int attempt = 1; attempt <= static_cast<int>(jobs.at(job).attempts.size()); ++attempt) {
      const std::pair key{job, attempt};
      if (stale.erase(key) > 0) undo.push_back([this, key] { stale.insert(key); });
    }
    Erase(results, job);
    Erase(jobs, job);
  }
  std::vector<std::int64_t> its_cells;
  for (const auto& [cell, experiment] : cells) {
    if (experiment == op.experiment_id) its_cells.push_back(cell);
  }
  for (const std::int64_t cell : its_cells) Erase(cells, cell);
  submissions.erase(summary.submission_id);
  undo.push_back([this, id = summary.submission_id] { submissions.insert(id); });
  Erase(experiments, op.experiment_id);
}

void MemoryStore::Tables::Do(const RenameExperiment& op) {
  Require(FaultOfName(op.name).empty(), "bad name");
  Set(ExperimentOf(op.experiment_id).summary.name, op.name);
}

void MemoryStore::Tables::Do(const TagExperiment& op) {
  Require(FaultOfTag(op.tag).empty(), "bad tag");
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
    Require(job.experiment_id != op.experiment_id || IsTerminal(job.state), "experiment has open jobs");
  }
  Close(op.experiment_id, ExperimentState::kDone, op.at_us);
}

void MemoryStore::Tables::Do(const PutWorker& op) {
  Require(op.worker.worker_id > 0 && op.worker.endpoint > 0 && op.worker.slots >= 1 && op.worker.pid >= 0,
          "bad worker");
  const auto known = workers.find(op.worker.worker_id);
  if (known == workers.end()) {
    InsertKey(endpoints, op.worker.endpoint, "endpoint");
    Insert(workers, op.worker.worker_id, op.worker, "worker");
  } else {
    Require(known->second.endpoint == op.worker.endpoint, "a worker keeps its endpoint");
    Set(known->second, op.worker);
  }
}

void MemoryStore::Tables::Do(const RecordEvent& op) {
  Require(!op.kind.empty() && op.kind.find_first_not_of("abcdefghijklmnopqrstuvwxyz_") == std::string::npos,
          "bad event");
  Require(!op.experiment_id || experiments.contains(*op.experiment_id), "event of an unknown experiment");
  Require(!op.job_id || jobs.contains(*op.job_id), "event of an unknown job");
  Require(!op.worker_id || workers.contains(*op.worker_id), "event of an unknown worker");
  Set(events, events + 1);
}

ExperimentSummary MemoryStore::Tables::Summarize(const ExperimentRow& row) const {
  ExperimentSummary summary = row.summary;
  for (std::int64_t id = summary.first_job_id; id < summary.first_job_id + summary.num_jobs; ++id) {
    ++summary.jobs_by_state[jobs.at(id).state];
    const auto result = results.find(id);
    if (result != results.end() && result->second.result.verdict_literal == Verdict::kSuccess) ++summary.solved;
  }
  return summary;
}

OpenExperiment MemoryStore::Tables::Open(const ExperimentRow& row) const {
  OpenExperiment open;
  open.experiment_id = row.summary.experiment_id;
  open.spec_json = row.spec_json;
  open.cell_times.resize(row.num_cells);
  for (std::int64_t id = row.summary.first_job_id; id < row.summary.first_job_id + row.summary.num_jobs; ++id) {
    const JobRow& job = jobs.at(id);
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
    open_job.solved = result->second.result.verdict_literal == Verdict::kSuccess;
    open.cell_times[job.cell].wall_us += result->second.result.wall_us;
    open.cell_times[job.cell].waypoints += result->second.result.num_waypoints;
  }
  return open;
}

MemoryStore::MemoryStore() : tables_(std::make_unique<Tables>()) {}
MemoryStore::~MemoryStore() = default;

void MemoryStore::Apply(std::span<const StoreOp> operations) {
  if (fault_) throw StoreError(*fault_, "memory store: injected fault");
  tables_->undo.clear();
  try {
    for (const StoreOp& operation : operations) {
      std::visit([this](const auto& op) { tables_->Do(op); }, operation);
    }
  } catch (const StoreError&) {
    for (auto undo = tables_->undo.rbegin(); undo != tables_->undo.rend(); ++undo) (*undo)();
    throw;
  }
}

OpenState MemoryStore::LoadOpenState() {
  const auto after_last = [](const auto& map, std::int64_t deleted = 0) {
    return std::max(map.empty() ? 0 : map.rbegin()->first, deleted) + 1;
  };
  OpenState state;
  state.next_experiment_id = after_last(tables_->experiments, tables_->deleted_experiment);
  state.next_job_id = after_last(tables_->jobs, tables_->deleted_job);
  state.next_cell_id = after_last(tables_->cells, tables_->deleted_cell);
  state.next_worker_id = after_last(tables_->workers);
  for (const auto& [id, row] : tables_->experiments) {
    state.experiments.push_back(tables_->Summarize(row));
    if (row.summary.state != ExperimentState::kActive) continue;
    state.open.push_back(tables_->Open(row));
  }
  state.workers = tables_->workers;
  return state;
}

std::optional<OpenExperiment> MemoryStore::LoadExperiment(std::int64_t experiment_id) {
  const auto row = tables_->experiments.find(experiment_id);
  if (row == tables_->experiments.end()) return std::nullopt;
  return tables_->Open(row->second);
}

std::optional<AttemptRecord> MemoryStore::FindAttempt(std::int64_t job_id, int attempt) {
  const auto job = tables_->jobs.find(job_id);
  if (job == tables_->jobs.end() || attempt < 1 || attempt > static_cast<int>(job->second.attempts.size())) {
    return std::nullopt;
  }
  const Attempt& found = job->second.attempts[static_cast<std::size_t>(attempt) - 1];
  return AttemptRecord{found.token, found.worker_id, found.outcome, job->second.state};
}

std::optional<std::string> MemoryStore::FindMethodOptions(const std::string& hash) {
  const auto options = tables_->options.find(hash);
  if (options == tables_->options.end()) return std::nullopt;
  return options->second;
}

std::optional<MemoryStore::Accepted> MemoryStore::accepted_result(std::int64_t job_id) const {
  const auto result = tables_->results.find(job_id);
  if (result == tables_->results.end()) return std::nullopt;
  return result->second;
}

std::int64_t MemoryStore::num_accepted() const { return static_cast<std::int64_t>(tables_->results.size()); }
std::int64_t MemoryStore::num_stale() const { return static_cast<std::int64_t>(tables_->stale.size()); }
bool MemoryStore::has_stale(std::int64_t job_id, int attempt) const {
  return tables_->stale.contains({job_id, attempt});
}

std::optional<JobState> MemoryStore::job_state(std::int64_t job_id) const {
  const auto job = tables_->jobs.find(job_id);
  if (job == tables_->jobs.end()) return std::nullopt;
  return job->second.state;
}

int MemoryStore::num_attempts(std::int64_t job_id) const {
  const auto job = tables_->jobs.find(job_id);
  return job == tables_->jobs.end() ? 0 : static_cast<int>(job->second.attempts.size());
}

}  // namespace legopt::db
