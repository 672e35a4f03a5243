#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "db/sqlite_statements.h"
#include "db/sqlite_store_impl.h"

namespace legopt::db {

std::optional<AttemptRecord> SqliteStore::FindAttempt(std::int64_t job_id, int attempt) {
  Statement& s = statements_->find_attempt;
  std::optional<AttemptRecord> record;
  if (s.BindAll(job_id, attempt).Step()) {
    record =
        AttemptRecord{s.column_int(0), s.column_int(1), s.column_enum<AttemptOutcome>(2), s.column_enum<JobState>(3)};
  }
  s.Reset();
  return record;
}

std::optional<std::string> SqliteStore::FindMethodOptions(const std::string& hash) {
  Statement& s = statements_->find_options;
  std::optional<std::string> options;
  if (s.BindAll(hash).Step()) options = s.column_text(0);
  s.Reset();
  return options;
}

std::optional<std::string> SqliteStore::FindDatasetArchive(const std::string& hash) {
  Statement find(connection_, sql::kFindArchive, false);
  if (!find.BindAll(hash).Step()) return std::nullopt;
  return find.column_text(0);
}

ArchiveFacts SqliteStore::FindArchiveFacts(const std::string& hash) {
  Statement find(connection_, sql::kArchiveFacts, false);
  find.BindAll(hash).Step();
  return {find.column_int(0) != 0, find.column_int(1) != 0, find.column_int(2)};
}

std::vector<std::int64_t> SqliteStore::FindEqualExperiments(const ResultSearch& search) {
  Statement& s = statements_->find_equal_experiments;
  std::vector<std::int64_t> experiments;
  s.BindAll(search.method_hash, search.dataset_hash, search.task, search.initialization, search.seed,
            search.effort_limit, search.experiment_id, search.build_id.value_or(""));
  while (s.Step()) experiments.push_back(s.column_int(0));
  s.Reset();
  return experiments;
}

std::vector<KnownResult> SqliteStore::FindKnownResults(const ResultSearch& search) {
  Statement& s = statements_->find_known_result;
  std::vector<KnownResult> found(search.problems.size());
  std::size_t left = found.size();
  for (const std::int64_t experiment : FindEqualExperiments(search)) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i].job_id != 0) continue;
      s.BindAll(experiment, search.method_hash, search.task, search.initialization, search.effort_limit,
                search.wall_limit_us, search.memory_limit_bytes, search.build_id.value_or(""),
                search.problems[i].number, search.problems[i].repetition, search.rule);
      if (s.Step()) {
        found[i] = {s.column_int(0), s.column_int(1), s.column_int(2) != 0};
        --left;
      }
      s.Reset();
    }
    if (left == 0) break;
  }
  return found;
}

OpenState SqliteStore::LoadOpenState() {
  OpenState state;
  state.next_experiment_id = NextId("experiment", "experiments");
  state.next_job_id = NextId("job", "jobs");
  state.next_cell_id = NextId("cell", "cells");
  state.next_worker_id = connection_.QueryInt("SELECT coalesce(max(worker_id), 0) + 1 FROM workers");
  LoadSummaries(state);
  LoadOpenJobs(state);
  LoadWorkers(state);
  return state;
}

// Returns one more than the largest id ever used, including ids of deleted rows.
std::int64_t SqliteStore::NextId(const char* kind, const char* table) {
  const std::string column = std::string(kind) + "_id";
  return connection_.QueryInt("SELECT 1 + max((SELECT coalesce(max(" + column + "), 0) FROM " + table +
                              "), coalesce((SELECT largest FROM deleted_ids WHERE kind = '" + kind + "'), 0))");
}

void SqliteStore::LoadSummaries(OpenState& state) {
  std::map<std::int64_t, ExperimentSummary> by_id;
  Statement experiments(
      connection_,
      "SELECT experiment_id, submission_id, name, spec_hash, state, first_job_id, num_jobs, "
      "submitted_at_us, coalesce(finished_at_us, 0), iif(hold = 'held', 'paused', hold), hold_reason, priority, "
      "submitter, builds, "
      "coalesce(build_id, ''), "
      "(SELECT name FROM datasets AS d WHERE d.dataset_id = e.dataset_id), rule FROM experiments AS e");
  while (experiments.Step()) {
    ExperimentSummary& summary = by_id[experiments.column_int(0)];
    summary.experiment_id = experiments.column_int(0);
    summary.submission_id = experiments.column_text(1);
    summary.name = experiments.column_text(2);
    summary.spec_hash = experiments.column_text(3);
    summary.state = experiments.column_enum<ExperimentState>(4);
    summary.first_job_id = experiments.column_int(5);
    summary.num_jobs = experiments.column_int(6);
    summary.submitted_at_us = experiments.column_int(7);
    summary.finished_at_us = experiments.column_int(8);
    summary.control = {experiments.column_enum<ExperimentHold>(9), experiments.column_text(10),
                       static_cast<int>(experiments.column_int(11)), experiments.column_enum<BuildPolicy>(13),
                       experiments.column_text(14)};
    summary.submitter = experiments.column_text(12);
    summary.dataset = experiments.column_text(15);
    summary.rule = experiments.column_enum<Rule>(16);
  }
  LoadDescriptions(by_id);
  LoadCounts(by_id);
  for (auto& [id, summary] : by_id) state.experiments.push_back(std::move(summary));
}

// Counts per cell using the indexes. Grouping the jobs themselves would sort all jobs in memory: 500 MB for ten
// million. A job is done if and only if it has a result.
void SqliteStore::LoadCounts(std::map<std::int64_t, ExperimentSummary>& by_id) {
  Statement cells(connection_, sql::kCountByCell);
  while (cells.Step()) {
    ExperimentSummary& summary = by_id[cells.column_int(0)];
    const std::int64_t open = cells.column_int(2), leased = cells.column_int(3), dead = cells.column_int(4);
    const std::int64_t done = cells.column_int(5), failed = cells.column_int(6);
    summary.jobs_by_state[JobState::kQueued] += open - leased;
    summary.jobs_by_state[JobState::kLeased] += leased;
    summary.jobs_by_state[JobState::kDead] += dead;
    summary.jobs_by_state[JobState::kDone] += done;
    summary.jobs_by_state[JobState::kFailed] += failed;
    summary.jobs_by_state[JobState::kCancelled] += cells.column_int(1) - open - dead - done - failed;
    summary.solved += cells.column_int(7);
    summary.taken_over += cells.column_int(8);
  }
}

void SqliteStore::LoadDescriptions(std::map<std::int64_t, ExperimentSummary>& by_id) {
  Statement tags(connection_, "SELECT experiment_id, tag FROM experiment_tags");
  while (tags.Step()) by_id[tags.column_int(0)].tags.insert(tags.column_text(1));
  Statement methods(connection_,
                    "SELECT c.experiment_id, m.name FROM cells AS c JOIN methods AS m USING (method_id) "
                    "GROUP BY c.experiment_id, m.name ORDER BY c.experiment_id, min(c.cell_id)");
  while (methods.Step()) by_id[methods.column_int(0)].methods.push_back(methods.column_text(1));
}

void SqliteStore::LoadOpenJobs(OpenState& state) {
  for (const ExperimentSummary& summary : state.experiments) {
    if (summary.state != ExperimentState::kActive) continue;
    state.open.push_back(LoadExperiment(summary.experiment_id).value());
  }
}

std::optional<OpenExperiment> SqliteStore::LoadExperiment(std::int64_t experiment_id) {
  Statement experiment(connection_,
                       "SELECT spec_json, first_job_id, num_jobs, rule FROM experiments WHERE experiment_id = ?1");
  if (!experiment.BindAll(experiment_id).Step()) return std::nullopt;
  OpenExperiment open;
  open.experiment_id = experiment_id;
  open.spec_json = experiment.column_text(0);
  LoadJobs(experiment.column_int(1), experiment.column_int(2), experiment.column_enum<Rule>(3), open);
  return open;
}

void SqliteStore::LoadJobs(std::int64_t first_job_id, std::int64_t num_jobs, Rule rule, OpenExperiment& open) {
  Statement jobs(connection_,
                 "SELECT j.state, j.attempts, j.returned, coalesce(a.token, 0), coalesce(a.worker_id, 0), "
                 "coalesce(a.outcome, 'running'), coalesce(r.solver_status = 'time_limit', 0), "
                 "coalesce(CASE ?3 WHEN 'literal' THEN r.solved_literal WHEN 'strict' THEN r.solved_strict "
                 "WHEN 'solid' THEN r.verdict_solid = 'success' ELSE r.verdict_physical = 'success' END, 0), "
                 "coalesce(a.leased_at_us, 0), coalesce(a.ended_at_us, 0), j.cell_id, "
                 "coalesce(r.wall_us, 0), coalesce(r.num_waypoints, 0) FROM jobs AS j "
                 "LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts "
                 "LEFT JOIN results AS r ON r.job_id = j.job_id "
                 "WHERE j.job_id >= ?1 AND j.job_id < ?2 ORDER BY j.job_id");
  open.jobs.reserve(static_cast<std::size_t>(num_jobs));
  jobs.BindAll(first_job_id, first_job_id + num_jobs, rule);
  for (std::int64_t last_cell = 0; jobs.Step(); last_cell = jobs.column_int(10)) {
    if (jobs.column_int(10) != last_cell) open.cell_times.emplace_back();  // the jobs of a cell are contiguous
    open.cell_times.back().wall_us += jobs.column_int(11);
    open.cell_times.back().waypoints += jobs.column_int(12);
    open.jobs.push_back({jobs.column_enum<JobState>(0), static_cast<int>(jobs.column_int(1)),
                         static_cast<int>(jobs.column_int(2)), jobs.column_int(3), jobs.column_int(4),
                         jobs.column_enum<AttemptOutcome>(5), jobs.column_int(6) != 0, jobs.column_int(7) != 0,
                         jobs.column_int(8), jobs.column_int(9)});
  }
  if (static_cast<std::int64_t>(open.jobs.size()) != num_jobs) {
    throw StoreError(StoreErrorCode::kCorrupt, "experiment " + std::to_string(open.experiment_id) + " has " +
                                                   std::to_string(open.jobs.size()) + " jobs instead of " +
                                                   std::to_string(num_jobs) + "; restore a backup");
  }
}

void SqliteStore::LoadWorkers(OpenState& state) {
  Statement workers(connection_,
                    "SELECT worker_id, endpoint, name, hostname, pid, slots, build, last_seen_at_us, "
                    "coalesce(build_id, ''), processor, processors, coalesce(memory_bytes, 0), load FROM workers");
  while (workers.Step()) {
    WorkerRecord& worker = state.workers[workers.column_int(0)];
    worker.worker_id = workers.column_int(0);
    worker.endpoint = workers.column_int(1);
    worker.name = workers.column_text(2);
    worker.hostname = workers.column_text(3);
    worker.pid = workers.column_int(4);
    worker.slots = static_cast<int>(workers.column_int(5));
    worker.build = workers.column_text(6);
    worker.seen_at_us = workers.column_int(7);
    worker.build_id = workers.column_text(8);
    worker.processor = workers.column_text(9);
    worker.processors = static_cast<int>(std::max<std::int64_t>(workers.column_int(10), 1));
    worker.memory_bytes = workers.column_int(11);
    worker.load = workers.column_type(12) == Statement::Type::kNull ? std::numeric_limits<double>::quiet_NaN()
                                                                    : workers.column_double(12);
  }
}

}  // namespace legopt::db
