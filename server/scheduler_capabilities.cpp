// Matching of workers and jobs.

#include <algorithm>
#include <iterator>
#include <utility>

#include "server/scheduler.h"

namespace legopt::server {
namespace {

std::string NameOf(const Experiment& experiment) { return "experiment " + std::to_string(experiment.experiment_id()); }

// Returns why a worker without `need` gets no jobs of the experiment.
std::string TextOfLack(const Experiment& experiment, const JobRequirement& need, const db::WorkerRecord& record,
                       const WorkerCapabilities& abilities) {
  if (need.kind == JobRequirement::Kind::kBuild) {
    return NameOf(experiment) + " was begun by build " + need.hash + " and is finished by it; this worker is build " +
           record.build_id;
  }
  const bool dataset = need.kind == JobRequirement::Kind::kDataset;
  const bool solver = need.kind == JobRequirement::Kind::kSolver;
  const std::string other = dataset  ? abilities.HashOf(CapabilityKind::kDataset, need.name)
                            : solver ? abilities.HashOf(CapabilityKind::kSolver, need.name)
                                     : std::string();
  if (dataset) {
    return NameOf(experiment) + " was submitted with dataset '" + need.name + "' of content " + need.hash + "; " +
           (other.empty() ? "this worker does not have it" : "this worker's '" + need.name + "' has content " + other);
  }
  return NameOf(experiment) + " needs " + TextOf(need) + "; " +
         (other.empty() ? "this worker does not have it; " + RemedyOf(need)
                        : "this worker's '" + need.name + "' has other files, of hash " + other);
}

}  // namespace

std::vector<JobRequirement> Scheduler::NeedsOf(const Experiment& experiment, const Experiment::Group& group) const {
  std::vector<JobRequirement> needs = group.needs;
  const db::ExperimentControl& control = summaries_.at(experiment.experiment_id()).control;
  if (control.builds == BuildPolicy::kOne && !control.build_id.empty()) {
    needs.push_back({JobRequirement::Kind::kBuild, {}, control.build_id});
  }
  return needs;
}

bool Scheduler::CanSatisfy(const WorkerProfile& worker, const JobRequirement& need) const {
  return worker.abilities.Has(need) ||
         (need.kind == JobRequirement::Kind::kDataset && worker.abilities.WouldFetch(need.hash) &&
          offered_datasets_.contains(need.hash));
}

std::vector<JobRequirement> Scheduler::UnmetNeeds(const WorkerProfile& worker,
                                                  const std::vector<JobRequirement>& needs) const {
  std::vector<JobRequirement> lacks;
  std::copy_if(needs.begin(), needs.end(), std::back_inserter(lacks),
               [&](const JobRequirement& need) { return !CanSatisfy(worker, need); });
  return lacks;
}

void Scheduler::SetDatasetOffered(const std::string& hash, bool offered) {
  const bool changed = offered ? offered_datasets_.insert(hash).second : offered_datasets_.erase(hash) > 0;
  if (!changed) return;
  for (const auto& [id, experiment] : open_) {
    if (experiment->spec().dataset.hash != hash) continue;
    RecountWorkers(*experiment);
    UpdateWaiting(*experiment);
  }
}

// Asks whether the server offers the dataset. This reads the store, which may fail, so call it before any change.
void Scheduler::UpdateOffered(const std::string& hash) {
  if (lookup_.dataset_offered) SetDatasetOffered(hash, lookup_.dataset_offered(hash));
}

bool Scheduler::Admits(const WorkerProfile& worker, const Experiment& experiment, const Experiment::Group& group,
                       Datasets datasets) const {
  const auto has = [&](const JobRequirement& need) {
    return datasets == Datasets::kPresent ? worker.abilities.Has(need) : CanSatisfy(worker, need);
  };
  const db::ExperimentControl& control = summaries_.at(experiment.experiment_id()).control;
  const bool bound = control.builds == BuildPolicy::kOne && !control.build_id.empty();
  return !worker.draining && std::all_of(group.needs.begin(), group.needs.end(), has) &&
         (!bound || has({JobRequirement::Kind::kBuild, {}, control.build_id})) &&
         (worker.refused.empty() || !worker.refused.contains({group.method_hash, group.task}));
}

bool Scheduler::CanWorkOn(const WorkerProfile& worker, const Experiment& experiment) const {
  const std::vector<Experiment::Group>& groups = experiment.groups();
  const bool any_queued =
      std::any_of(groups.begin(), groups.end(), [](const Experiment::Group& group) { return group.queued > 0; });
  return std::any_of(groups.begin(), groups.end(), [&](const Experiment::Group& group) {
    return (group.queued > 0 || !any_queued) && Admits(worker, experiment, group, Datasets::kPresentOrOffered);
  });
}

void Scheduler::CountWorker(const WorkerProfile& worker, int change) {
  for (const auto& [id, open] : open_) {
    Experiment& experiment = *open;
    const auto admits = [&](const Experiment::Group& group) {
      return Admits(worker, experiment, group, Datasets::kPresentOrOffered);
    };
    experiment.CountWorker(admits, change);
    UpdateWaiting(experiment);
  }
}

void Scheduler::RecountWorkers(Experiment& experiment) {
  experiment.ClearWorkerCounts();
  for (const auto& [id, worker] : workers_) {
    if (!worker.counted) continue;
    const WorkerProfile& profile = *worker.counted;
    const auto admits = [&](const Experiment::Group& group) {
      return Admits(profile, experiment, group, Datasets::kPresentOrOffered);
    };
    experiment.CountWorker(admits, 1);
  }
}

// Also called when the worker's profile has changed. The new profile is counted before the old one is removed, so that
// no experiment stops waiting in between.
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

// Returns the content hash of the dataset that the worker should fetch to run queued jobs; empty if there are none. The
// oldest experiment of the largest priority is chosen.
std::string Scheduler::WantedDataset(const WorkerProfile& worker) const {
  if (!worker.abilities.FetchesDatasets()) return {};
  const Experiment* wanted = nullptr;
  const auto priority = [this](const Experiment& e) { return summaries_.at(e.experiment_id()).control.priority; };
  for (const auto& [id, open] : open_) {
    const Experiment& experiment = *open;
    if (summaries_.at(id).control.hold != db::ExperimentHold::kNone) continue;
    const std::vector<Experiment::Group>& groups = experiment.groups();
    const bool any = std::any_of(groups.begin(), groups.end(), [&](const Experiment::Group& group) {
      return group.queued > 0 && Admits(worker, experiment, group, Datasets::kPresentOrOffered);
    });
    if (any && (wanted == nullptr || priority(experiment) > priority(*wanted))) wanted = &experiment;
  }
  return wanted == nullptr ? std::string() : wanted->spec().dataset.hash;
}

// Returns an empty string if there is no queued job, or one that the worker can run, possibly after fetching its
// dataset. Otherwise returns the missing capability. `same_name` is set if the worker has a dataset of the wanted name
// with other content and cannot fetch datasets: this is a mistake rather than a worker for other experiments.
std::string Scheduler::MismatchOf(const Worker& worker, bool* same_name) const {
  std::string text;
  *same_name = false;
  if (worker.profile.draining) return "this worker is drained and gets no more jobs";
  const WorkerCapabilities& abilities = worker.profile.abilities;
  for (const auto& [id, open] : open_) {
    const Experiment& experiment = *open;
    if (summaries_.at(id).control.hold != db::ExperimentHold::kNone) continue;
    for (const Experiment::Group& group : experiment.groups()) {
      if (group.queued == 0) continue;
      if (Admits(worker.profile, experiment, group, Datasets::kPresentOrOffered)) {
        *same_name = false;
        return {};
      }
      const std::vector<JobRequirement> lacks = UnmetNeeds(worker.profile, NeedsOf(experiment, group));
      if (lacks.empty()) {
        const auto refused = worker.profile.refused.find({group.method_hash, group.task});
        if (refused == worker.profile.refused.end()) continue;
        if (text.empty()) text = "this worker has refused jobs of " + NameOf(experiment) + ": " + refused->second;
        continue;
      }
      const JobRequirement& lack = lacks.front();
      const bool twin = lack.kind == JobRequirement::Kind::kDataset && !abilities.FetchesDatasets() &&
                        !abilities.HashOf(CapabilityKind::kDataset, lack.name).empty();
      if (text.empty() || (twin && !*same_name)) text = TextOfLack(experiment, lack, worker.record, abilities);
      *same_name = *same_name || twin;
    }
  }
  return text;
}

// The worker gets no more jobs of this method and task; otherwise it could take and refuse the same job forever.
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
