// Which workers can take which jobs.

#include <algorithm>
#include <utility>

#include "server/scheduler.h"

namespace legopt::server {
namespace {

std::string NameOf(const Experiment& experiment) { return "experiment " + std::to_string(experiment.experiment_id()); }

// Why a worker without `need` gets no jobs of the experiment.
std::string TextOfLack(const Experiment& experiment, const Need& need, const db::WorkerRecord& record,
                       const Abilities& abilities) {
  if (need.kind == Need::Kind::kBuild) {
    return NameOf(experiment) + " was begun by build " + need.hash + " and is finished by it; this worker is build " +
           record.build_id;
  }
  const bool dataset = need.kind == Need::Kind::kDataset;
  const bool solver = need.kind == Need::Kind::kSolver;
  const std::string other = dataset  ? abilities.HashOf(CapabilityKind::kDataset, need.name)
                            : solver ? abilities.HashOf(CapabilityKind::kSolver, need.name)
                                     : std::string();
  if (dataset) {
    return NameOf(experiment) + " was submitted with dataset '" + need.name + "' of content " + need.hash + "; " +
           (other.empty() ? "this worker does not have it" : "this worker's '" + need.name + "' has content " + other);
  }
  return NameOf(experiment) + " needs " + TextOf(need) + "; " +
         (other.empty() ? "this worker does not have it; " + CureOf(need)
                        : "this worker's '" + need.name + "' has other files, of hash " + other);
}

}  // namespace

std::vector<Need> Scheduler::NeedsOf(const Experiment& experiment, const Experiment::Group& group) const {
  std::vector<Need> needs = group.needs;
  const db::ExperimentControl& control = summaries_.at(experiment.experiment_id()).control;
  if (control.builds == BuildRule::kOne && !control.build_id.empty()) {
    needs.push_back({Need::Kind::kBuild, {}, control.build_id});
  }
  return needs;
}

bool Scheduler::Admits(const WorkerProfile& worker, const Experiment& experiment,
                       const Experiment::Group& group) const {
  const auto has = [&worker](const Need& need) { return worker.abilities.Has(need); };
  const db::ExperimentControl& control = summaries_.at(experiment.experiment_id()).control;
  const bool bound = control.builds == BuildRule::kOne && !control.build_id.empty();
  return !worker.draining && std::all_of(group.needs.begin(), group.needs.end(), has) &&
         (!bound || has({Need::Kind::kBuild, {}, control.build_id})) &&
         (worker.refused.empty() || !worker.refused.contains({group.method_hash, group.task}));
}

bool Scheduler::CanWorkOn(const WorkerProfile& worker, const Experiment& experiment) const {
  const std::vector<Experiment::Group>& groups = experiment.groups();
  const bool any_queued =
      std::any_of(groups.begin(), groups.end(), [](const Experiment::Group& group) { return group.queued > 0; });
  return std::any_of(groups.begin(), groups.end(), [&](const Experiment::Group& group) {
    return (group.queued > 0 || !any_queued) && Admits(worker, experiment, group);
  });
}

void Scheduler::CountWorker(const WorkerProfile& worker, int change) {
  for (const auto& [id, open] : open_) {
    Experiment& experiment = *open;
    experiment.CountWorker([&](const Experiment::Group& group) { return Admits(worker, experiment, group); }, change);
    UpdateWaiting(experiment);
  }
}

void Scheduler::RecountWorkers(Experiment& experiment) {
  experiment.ForgetWorkers();
  for (const auto& [id, worker] : workers_) {
    if (!worker.counted) continue;
    const WorkerProfile& profile = *worker.counted;
    experiment.CountWorker([&](const Experiment::Group& group) { return Admits(profile, experiment, group); }, 1);
  }
}

// Also when its profile has changed. It is counted as what it is before it is no longer counted as what it was, so that
// no experiment ceases to wait in between.
void Scheduler::SetOnline(Worker& worker, bool online) {
  online_workers_ += (online ? 1 : 0) - (worker.online ? 1 : 0);
  const int slots = online ? worker.record.slots : 0;
  online_slots_ += slots - worker.online_slots;
  worker.online_slots = slots;
  worker.online = online;
  const std::optional<WorkerProfile> profile = online ? std::optional(worker.profile) : std::nullopt;
  if (profile == worker.counted) return;
  const std::optional<WorkerProfile> before = std::exchange(worker.counted, profile);
  if (profile) CountWorker(*profile, 1);
  if (before) CountWorker(*before, -1);
}

// Empty when there is no queued job, or one that the worker can take. Otherwise says what it lacks; `same_name` tells
// that it has a dataset of the wanted name with other content, which is a mistake rather than another purpose.
std::string Scheduler::MismatchOf(const Worker& worker, bool* same_name) const {
  std::string text;
  *same_name = false;
  if (worker.profile.draining) return "this worker is drained and gets no more jobs";
  const Abilities& abilities = worker.profile.abilities;
  for (const auto& [id, open] : open_) {
    const Experiment& experiment = *open;
    if (summaries_.at(id).control.hold != db::Hold::kNone) continue;
    for (const Experiment::Group& group : experiment.groups()) {
      if (group.queued == 0) continue;
      if (Admits(worker.profile, experiment, group)) {
        *same_name = false;
        return {};
      }
      const std::vector<Need> lacks = abilities.LacksOf(NeedsOf(experiment, group));
      if (lacks.empty()) {
        const auto refused = worker.profile.refused.find({group.method_hash, group.task});
        if (refused == worker.profile.refused.end()) continue;
        if (text.empty()) text = "this worker has refused jobs of " + NameOf(experiment) + ": " + refused->second;
        continue;
      }
      const Need& lack = lacks.front();
      const bool twin =
          lack.kind == Need::Kind::kDataset && !abilities.HashOf(CapabilityKind::kDataset, lack.name).empty();
      if (text.empty() || (twin && !*same_name)) text = TextOfLack(experiment, lack, worker.record, abilities);
      *same_name = *same_name || twin;
    }
  }
  return text;
}

// The worker gets no more jobs of this method and task, so that it cannot take and refuse the same job for ever.
void Scheduler::NoteRefusal(const Instant& now, const JobRef& ref, const std::string& why, Ops& ops) {
  ++counters_.attempts_refused;
  const std::int64_t job_id = ref.experiment->job_id(ref.index);
  const std::int64_t worker_id = leases_.at(job_id).worker_id;
  Worker& worker = workers_[worker_id];
  const Experiment::Group& group = ref.experiment->GroupOf(ref.index);
  if (!worker.profile.refused.emplace(std::pair(group.method_hash, group.task), why).second) return;
  SetOnline(worker, worker.online);
  ops.emplace_back(db::RecordEvent{"jobs_refused", now.wall_us, ref.experiment->experiment_id(), job_id, worker_id,
                                   "worker '" + worker.record.name + "': " + why});
}

}  // namespace legopt::server
