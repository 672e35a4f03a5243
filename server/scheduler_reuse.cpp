// Reuse of finished results of identical jobs.

#include <vector>

#include "server/scheduler.h"

namespace legopt::server {

// Jobs with known results become done; the others wait for their leases. The state is consistent whether or not the
// request is answered.
void Scheduler::ReuseKnownResults(const Instant& now, Experiment& experiment, const Experiment::Range& range,
                                  const Worker& worker, Ops& ops) {
  const std::vector<db::KnownResult> known = KnownResultsOf(experiment, range, worker);
  experiment.SetSearched(range);
  for (std::int64_t index = range.first; index < range.end && !known.empty(); ++index) {
    const db::KnownResult& result = known[static_cast<std::size_t>(index - range.first)];
    const Job& job = experiment.job(index);
    const bool fresh = job.state == db::JobState::kQueued && job.attempts == 0;
    // Results deleted in the same round are still in the store.
    if (!fresh || result.job_id == 0 || IsDeleted(result.job_id)) continue;
    Bind(now, experiment, worker, ops);
    ReuseStoredResult(now, experiment, index, result, ops);
  }
  FinishIfComplete(now, experiment, ops);
}

// Returns one element per job of the range; empty if the experiment is restricted to one build and that build is
// unknown. Jobs are described by the inputs that determine their results, because rows of this experiment may not be
// committed yet.
std::vector<db::KnownResult> Scheduler::KnownResultsOf(const Experiment& experiment, const Experiment::Range& range,
                                                       const Worker& worker) const {
  const ExperimentSpec& spec = experiment.spec();
  const db::ExperimentControl& control = summaries_.at(experiment.experiment_id()).control;
  const JobCoordinates cell = CoordinatesOf(spec, range.first);
  const ExperimentSpec::TaskProblems& task = spec.tasks[cell.task];
  db::ResultSearch search;
  if (control.builds == BuildPolicy::kOne) {
    search.build_id = control.build_id.empty() ? worker.record.build_id : control.build_id;
    if (search.build_id->empty()) return {};
  }
  search.experiment_id = experiment.experiment_id();
  search.dataset_hash = spec.dataset.hash;
  search.method_hash = spec.methods[cell.method].hash;
  search.task = task.task;
  search.initialization = spec.initializations[cell.initialization];
  search.seed = spec.seed;
  search.effort_limit = task.effort_limit;
  search.wall_limit_us = task.wall_limit_us;
  search.memory_limit_bytes = spec.memory_limit_bytes;
  search.rule = summaries_.at(experiment.experiment_id()).rule;
  for (std::int64_t index = range.first; index < range.end; ++index) {
    const JobCoordinates at = CoordinatesOf(spec, index);
    search.problems.push_back({task.problems[at.problem], static_cast<int>(at.repetition)});
  }
  return lookup_.known_results(search);
}

void Scheduler::ReuseStoredResult(const Instant& now, Experiment& experiment, std::int64_t index,
                                  const db::KnownResult& known, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  Job& job = experiment.job(index);
  job.attempts = 1;
  job.token = tokens_();
  job.outcome = db::AttemptOutcome::kFinished;
  job.solved = known.solved;
  summary.solved += known.solved ? 1 : 0;
  ++summary.taken_over;
  ++counters_.results_taken_over;
  experiment.AddTime(index, known.wall_us);
  SetJobState(experiment, index, db::JobState::kDone);
  ops.emplace_back(db::ReuseResult{experiment.job_id(index), known.job_id, job.token, now.wall_us});
}

}  // namespace legopt::server
