#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "server/scheduler.h"

namespace legopt::server {

// Workers: when they are stored, considered lost, and removed from memory.

// Returns the worker with this address, after creating it if the address is unknown.
Scheduler::Worker& Scheduler::WorkerOf(bus::EndpointId sender) {
  const auto known = worker_of_endpoint_.find(sender);
  const bool unknown = known == worker_of_endpoint_.end();
  const std::int64_t worker_id = unknown ? next_worker_id_++ : known->second;
  if (unknown) worker_of_endpoint_.emplace(sender, worker_id);
  const auto [worker, created] = workers_.try_emplace(worker_id);
  if (created) {
    worker->second.record.worker_id = worker_id;
    // The address of a removed worker is known only if the worker is stored.
    worker->second.stored = !unknown;
  }
  return worker->second;
}

// Heartbeats change nothing in the store; this stores when the server last heard of a worker.
void Scheduler::StoreSighting(Worker& worker, Ops& ops) {
  worker.stored_seen = worker.last_seen;
  ops.emplace_back(db::PutWorker{worker.record});
}

// Called before the first lease of a worker. Until then the worker has no row, because any process can say hello.
void Scheduler::Enlist(const Instant& now, Worker& worker, Ops& ops) {
  if (worker.stored) return;
  CountNew(worker, 0);
  worker.stored = true;
  StoreSighting(worker, ops);
  ops.emplace_back(db::RecordEvent{"worker_joined", now.wall_us, {}, {}, worker.record.worker_id, worker.record.name});
}

// Sets the memory counted for a worker that is not stored.
void Scheduler::CountNew(Worker& worker, std::size_t bytes) {
  new_worker_bytes_ += bytes;
  new_worker_bytes_ -= worker.new_bytes;
  worker.new_bytes = bytes;
}

void Scheduler::UpdateWorkerStates(const Instant& now, Ops& ops) {
  const microseconds silence = options_.lease + options_.grace;
  std::vector<std::int64_t> forgotten;
  bool any_lost = false;
  for (auto& [id, worker] : workers_) {
    if (!worker.online) {
      const bool silent = worker.last_seen + options_.new_worker_kept <= now.steady;
      if (!worker.stored && silent) forgotten.push_back(id);
      continue;
    }
    const bool lost = worker.leaving || worker.last_seen + silence <= now.steady;
    const bool due = draining_ || lost || worker.stored_seen + options_.sighting <= now.steady;
    if (worker.stored && due && worker.stored_seen != worker.last_seen) StoreSighting(worker, ops);
    if (!lost) continue;
    any_lost = true;
    SetOnline(worker, false);
    if (!worker.stored) continue;
    const char* kind = worker.leaving ? "worker_left" : "worker_lost";
    ops.emplace_back(db::RecordEvent{kind, now.wall_us, {}, {}, id, worker.record.name});
  }
  for (const std::int64_t id : forgotten) EvictNewWorker(id);
  if (any_lost) EvictOfflineWorkers();
}

void Scheduler::EvictNewWorker(std::int64_t worker_id) {
  Worker& worker = workers_.at(worker_id);
  SetOnline(worker, false);
  CountNew(worker, 0);
  worker_of_endpoint_.erase(worker.record.endpoint);
  workers_.erase(worker_id);
}

// If new workers use too much memory, removes those silent for longest; a live one will say hello again. A quarter is
// removed at once, so that not every hello triggers a search.
void Scheduler::LimitNewWorkerMemory(std::int64_t newest) {
  if (new_worker_bytes_ <= options_.max_new_worker_bytes) return;
  std::vector<std::pair<microseconds, std::int64_t>> by_silence;
  for (const auto& [id, worker] : workers_) {
    if (!worker.stored && id != newest) by_silence.emplace_back(worker.last_seen, id);
  }
  std::sort(by_silence.begin(), by_silence.end());
  const std::size_t enough = options_.max_new_worker_bytes / 4 * 3;
  for (const auto& [seen, id] : by_silence) {
    if (new_worker_bytes_ <= enough) break;
    EvictNewWorker(id);
  }
}

// Workers have a new address after every start, so offline ones accumulate. Their rows stay in the store.
void Scheduler::EvictOfflineWorkers() {
  std::vector<std::pair<std::int64_t, std::int64_t>> gone;  // last seen, id
  for (const auto& [id, worker] : workers_) {
    if (worker.stored && !worker.online && worker.leases == 0) gone.emplace_back(worker.record.seen_at_us, id);
  }
  if (gone.size() <= options_.max_gone_workers) return;
  std::sort(gone.begin(), gone.end());
  gone.resize(gone.size() - options_.max_gone_workers);
  for (const auto& [seen, id] : gone) workers_.erase(id);
}

// Matching of workers and jobs.

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
