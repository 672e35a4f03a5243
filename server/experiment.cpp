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

// Returns a number whose bits all depend on all bits of `value`: the output function of SplitMix64 (Steele, Lea, Flood
// 2014).
std::uint64_t Scrambled(std::uint64_t value) {
  value += 0x9e3779b97f4a7c15;
  value = (value ^ (value >> 30)) * 0xbf58476d1ce4e5b9;
  value = (value ^ (value >> 27)) * 0x94d049bb133111eb;
  return value ^ (value >> 31);
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
      group.first = first;
      group.task_index = static_cast<std::size_t>(&task - spec_.tasks.data());
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

std::int64_t Experiment::JobAt(const Group& group, std::int64_t position) const {
  const auto problems = static_cast<std::int64_t>(spec_.tasks[group.task_index].problems.size());
  const auto starts = static_cast<std::int64_t>(spec_.initializations.size());
  const std::int64_t problem = position % problems, start = position / problems % starts,
                     repetition = position / problems / starts;
  return group.first + (start * problems + problem) * spec_.repetitions + repetition;
}

std::tuple<std::size_t, std::int64_t, std::uint64_t> Experiment::PlaceOf(const Group& group) const {
  const auto method = static_cast<std::uint64_t>(&group - groups_.data());
  const std::uint64_t block =
      Scrambled(static_cast<std::uint64_t>(spec_.seed) ^ Scrambled(static_cast<std::uint64_t>(group.next_fresh)));
  return {group.task_index, group.next_fresh, Scrambled(block ^ method)};
}

// Jobs that were leased or finished before a restart are skipped.
void Experiment::SkipTaken(Group& group) {
  std::set<std::int64_t>& returned = group.returned;
  while (!returned.empty() && job(*returned.begin()).state != db::JobState::kQueued) returned.erase(returned.begin());
  while (group.HasFresh() && job(JobAt(group, group.next_fresh)).state != db::JobState::kQueued) ++group.next_fresh;
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
    if (group.HasFresh() && (fresh == nullptr || PlaceOf(group) < PlaceOf(*fresh))) fresh = &group;
  }
  return fresh == nullptr ? std::nullopt : std::optional(JobAt(*fresh, fresh->next_fresh++));
}

std::vector<std::int64_t> Experiment::NextUnsearched(std::int64_t most, const Admits& admits) {
  if (spec_.again) return {};
  const Group* next = nullptr;
  for (Group& group : groups_) {
    if (group.queued == 0 || !admits(group)) continue;
    SkipTaken(group);
    if (!group.returned.empty()) return {};
    if (!group.HasFresh() || (next != nullptr && next->task_index < group.task_index)) continue;
    const bool unsearched = group.next_fresh >= group.searched;
    if (next == nullptr || group.task_index < next->task_index || unsearched) next = &group;
  }
  if (next == nullptr || next->next_fresh < next->searched) return {};
  std::vector<std::int64_t> jobs;
  for (std::int64_t position = next->next_fresh; position < next->end - next->first; ++position) {
    if (static_cast<std::int64_t>(jobs.size()) == most) break;
    jobs.push_back(JobAt(*next, position));
  }
  return jobs;
}

void Experiment::SetSearched(const std::vector<std::int64_t>& jobs) {
  Group& group = MutableGroupOf(jobs.front());
  group.searched = group.next_fresh + static_cast<std::int64_t>(jobs.size());
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
