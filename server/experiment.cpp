#include "server/experiment.h"

#include <algorithm>
#include <utility>

namespace legopt::server {
namespace {

// Returns the time during which at least one of the jobs' latest attempts was running. Attempts that are still running
// are assumed to have run until the last recorded event of the experiment.
std::chrono::microseconds TimeOfLatestAttempts(const std::vector<db::OpenJob>& jobs) {
  std::int64_t last_heard_us = 0;
  for (const db::OpenJob& job : jobs) last_heard_us = std::max({last_heard_us, job.leased_at_us, job.ended_at_us});
  std::vector<std::pair<std::int64_t, std::int64_t>> spans;
  for (const db::OpenJob& job : jobs) {
    if (job.leased_at_us == 0) continue;
    spans.emplace_back(job.leased_at_us, job.ended_at_us == 0 ? last_heard_us : job.ended_at_us);
  }
  std::sort(spans.begin(), spans.end());
  std::int64_t covered_us = 0, covered_until_us = 0;
  for (const auto& [from_us, until_us] : spans) {
    covered_us += std::max<std::int64_t>(until_us - std::max(from_us, covered_until_us), 0);
    covered_until_us = std::max(covered_until_us, until_us);
  }
  return std::chrono::microseconds(covered_us);
}

}  // namespace

Experiment::Experiment(std::int64_t experiment_id, std::int64_t first_job_id, ExperimentSpec spec)
    : experiment_id_(experiment_id),
      first_job_id_(first_job_id),
      spec_(std::move(spec)),
      jobs_(static_cast<std::size_t>(spec_.num_jobs())),
      use_of_task_(spec_.tasks.size()),
      use_of_kind_(spec_.methods.size() * spec_.tasks.size()),
      kind_times_(spec_.methods.size() * spec_.tasks.size() * spec_.initializations.size()) {
  MakeGroups();
}

// Jobs are ordered by method, then task.
void Experiment::MakeGroups() {
  std::int64_t first = 0;
  for (const db::MethodRecord& method : spec_.methods) {
    std::vector<JobRequirement> needs = {{JobRequirement::Kind::kDataset, spec_.dataset.name, spec_.dataset.hash},
                                         {JobRequirement::Kind::kMemory, {}, {}, spec_.memory_limit_bytes}};
    for (JobRequirement& need : NeedsOf(method)) needs.push_back(std::move(need));
    for (const ExperimentSpec::TaskProblems& task : spec_.tasks) {
      Group group;
      group.first = group.next_fresh = group.searched = first;
      group.end =
          first + static_cast<std::int64_t>(task.problems.size() * spec_.initializations.size()) * spec_.repetitions;
      group.queued = group.end - group.first;
      group.needs = needs;
      group.method_hash = method.hash;
      group.task = task.task;
      first = group.end;
      groups_.push_back(std::move(group));
    }
  }
}

bool Experiment::HasQueued(const Admits& admits) const {
  return std::any_of(groups_.begin(), groups_.end(),
                     [&](const Group& group) { return group.queued > 0 && admits(group); });
}

// Jobs that were leased or finished before a restart are skipped.
void Experiment::SkipTaken(Group& group) {
  std::set<std::int64_t>& returned = group.returned;
  while (!returned.empty() && job(*returned.begin()).state != db::JobState::kQueued) returned.erase(returned.begin());
  while (group.next_fresh < group.end && job(group.next_fresh).state != db::JobState::kQueued) ++group.next_fresh;
}

std::optional<std::int64_t> Experiment::TakeQueued(const Admits& admits) {
  Group* fresh = nullptr;
  for (Group& group : groups_) {
    if (group.queued == 0 || !admits(group)) continue;
    SkipTaken(group);
    if (!group.returned.empty()) {
      const std::int64_t index = *group.returned.begin();
      group.returned.erase(group.returned.begin());
      return index;
    }
    if (fresh == nullptr && group.next_fresh < group.end) fresh = &group;
  }
  return fresh == nullptr ? std::nullopt : std::optional(fresh->next_fresh++);
}

std::optional<Experiment::Range> Experiment::NextUnsearched(std::int64_t most, const Admits& admits) {
  if (spec_.again) return std::nullopt;
  const Group* fresh = nullptr;
  for (Group& group : groups_) {
    if (group.queued == 0 || !admits(group)) continue;
    SkipTaken(group);
    if (!group.returned.empty()) return std::nullopt;
    if (fresh == nullptr && group.next_fresh < group.end) fresh = &group;
  }
  if (fresh == nullptr || fresh->next_fresh < fresh->searched) return std::nullopt;
  Range range{fresh->next_fresh, fresh->next_fresh};
  const std::size_t kind = KindOf(range.first);
  while (range.end < fresh->end && range.end < range.first + most && KindOf(range.end) == kind) ++range.end;
  return range;
}

void Experiment::CountQueued(std::int64_t index, int change) {
  Group& group = MutableGroupOf(index);
  group.queued += change;
  if (group.able_workers > 0) takable_ += change;
}

void Experiment::CountWorker(const Admits& admits, int change) {
  for (Group& group : groups_) {
    if (!admits(group)) continue;
    const bool before = group.able_workers > 0;
    group.able_workers += change;
    const bool after = group.able_workers > 0;
    takable_ += ((after ? 1 : 0) - (before ? 1 : 0)) * group.queued;
  }
}

void Experiment::ClearWorkerCounts() {
  for (Group& group : groups_) group.able_workers = 0;
  takable_ = 0;
}

std::int64_t Experiment::ExpectedUse_us(std::int64_t index) const {
  const JobCoordinates at = CoordinatesOf(spec_, index);
  const Mean& kind = use_of_kind_[at.method * spec_.tasks.size() + at.task];
  const Mean& known = kind.count > 0 ? kind : use_of_task_[at.task];
  if (known.count > 0) return known.sum_us / known.count;
  // No attempt has ended yet. The wall limit alone is a safety net far above real times: an experiment charged with it
  // would get only one slot until its first job ends.
  constexpr std::int64_t kUsualEvaluation_us = 1;
  const ExperimentSpec::TaskProblems& task = spec_.tasks[at.task];
  if (task.effort_limit == 0) return task.wall_limit_us;
  return std::min(task.wall_limit_us, task.effort_limit * kUsualEvaluation_us);
}

void Experiment::NoteUse(std::int64_t index, std::int64_t used_us) {
  const JobCoordinates at = CoordinatesOf(spec_, index);
  for (Mean* mean : {&use_of_task_[at.task], &use_of_kind_[at.method * spec_.tasks.size() + at.task]}) {
    mean->sum_us += used_us;
    ++mean->count;
  }
}

std::size_t Experiment::KindOf(std::int64_t index) const {
  const JobCoordinates at = CoordinatesOf(spec_, index);
  return (at.method * spec_.tasks.size() + at.task) * spec_.initializations.size() + at.initialization;
}

void Experiment::AddTime(std::int64_t index, std::int64_t wall_us) {
  const JobCoordinates at = CoordinatesOf(spec_, index);
  KindTime& time = kind_times_[KindOf(index)];
  time.seconds += static_cast<double>(wall_us) * kSecondsPerMicrosecond;
  time.waypoints += spec_.tasks[at.task].waypoints[at.problem];
}

void Experiment::RestoreTimes(const db::OpenExperiment& stored) {
  for (std::size_t kind = 0; kind < std::min(kind_times_.size(), stored.cell_times.size()); ++kind) {
    const db::CellTime& time = stored.cell_times[kind];
    kind_times_[kind] = {static_cast<double>(time.wall_us) * kSecondsPerMicrosecond,
                         static_cast<double>(time.waypoints)};
  }
  worked = TimeOfLatestAttempts(stored.jobs);
}

db::NewExperiment MakeNewExperiment(const ExperimentSpec& spec, std::int64_t experiment_id, std::int64_t first_job_id,
                                    std::int64_t first_cell_id) {
  db::NewExperiment rows;
  rows.experiment_id = experiment_id;
  rows.name = spec.name;
  rows.spec_json = spec.canonical_json;
  rows.spec_hash = spec.hash;
  rows.submitter = spec.submitter;
  rows.builds = spec.builds;
  rows.rule = spec.rule;
  rows.seed = spec.seed;
  rows.repetitions = spec.repetitions;
  rows.max_attempts = spec.max_attempts;
  rows.memory_limit_bytes = spec.memory_limit_bytes;
  rows.dataset = spec.dataset;
  rows.methods = spec.methods;
  std::vector<int> first_problem;  // index in rows.problems of each task's first problem
  for (const ExperimentSpec::TaskProblems& task : spec.tasks) {
    rows.wall_limit_us = std::max(rows.wall_limit_us, task.wall_limit_us);
    first_problem.push_back(static_cast<int>(rows.problems.size()));
    for (std::size_t i = 0; i < task.problems.size(); ++i) {
      rows.problems.push_back({task.task, task.problems[i], task.waypoints[i]});
    }
  }
  for (std::size_t method = 0; method < spec.methods.size(); ++method) {
    for (const ExperimentSpec::TaskProblems& task : spec.tasks) {
      for (const Initialization initialization : spec.initializations) {
        const auto cell_id = first_cell_id + static_cast<std::int64_t>(rows.cells.size());
        const auto num_jobs = static_cast<std::int64_t>(task.problems.size()) * spec.repetitions;
        rows.cells.push_back({cell_id, static_cast<int>(method), task.task, initialization, num_jobs,
                              task.wall_limit_us, task.effort_limit});
      }
    }
  }
  const std::int64_t num_jobs = spec.num_jobs();
  rows.jobs.reserve(static_cast<std::size_t>(num_jobs));
  for (std::int64_t index = 0; index < num_jobs; ++index) {
    const JobCoordinates at = CoordinatesOf(spec, index);
    const std::size_t cell =
        (at.method * spec.tasks.size() + at.task) * spec.initializations.size() + at.initialization;
    rows.jobs.push_back({first_job_id + index, static_cast<int>(cell),
                         first_problem[at.task] + static_cast<int>(at.problem), static_cast<int>(at.repetition)});
  }
  return rows;
}

}  // namespace legopt::server
