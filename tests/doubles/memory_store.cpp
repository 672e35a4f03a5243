#include "tests/doubles/memory_store.h"

#include <algorithm>

#include "tests/doubles/memory_store_tables.h"

namespace legopt::db {

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
  const MemoryAttempt& found = job->second.attempts[static_cast<std::size_t>(attempt) - 1];
  return AttemptRecord{found.token, found.worker_id, found.outcome, job->second.state};
}

std::optional<std::string> MemoryStore::FindMethodOptions(const std::string& hash) {
  const auto options = tables_->options.find(hash);
  if (options == tables_->options.end()) return std::nullopt;
  return options->second;
}

std::optional<std::string> MemoryStore::FindDatasetArchive(const std::string& hash) {
  const auto archive = tables_->archives.find(hash);
  if (archive == tables_->archives.end()) return std::nullopt;
  return archive->second;
}

ArchiveFacts MemoryStore::FindArchiveFacts(const std::string& hash) {
  ArchiveFacts facts;
  facts.has_experiment = tables_->HasExperimentOn(hash);
  facts.stored = tables_->archives.contains(hash);
  for (const auto& [stored, archive] : tables_->archives) facts.stored_bytes += std::ssize(archive);
  return facts;
}

std::vector<KnownResult> MemoryStore::FindKnownResults(const ResultSearch& search) {
  std::vector<KnownResult> found;
  for (const ResultSearch::Problem& problem : search.problems) found.push_back(tables_->Known(search, problem));
  return found;
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

std::int64_t MemoryStore::taken_from(std::int64_t job_id) const {
  const auto job = tables_->jobs.find(job_id);
  return job == tables_->jobs.end() ? 0 : job->second.taken_from;
}

int MemoryStore::num_attempts(std::int64_t job_id) const {
  const auto job = tables_->jobs.find(job_id);
  return job == tables_->jobs.end() ? 0 : static_cast<int>(job->second.attempts.size());
}

}  // namespace legopt::db
