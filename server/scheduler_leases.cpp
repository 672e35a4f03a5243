#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "bus/messages.h"
#include "legopt/types/reply.h"
#include "server/scheduler.h"

namespace legopt::server {
namespace {

// Returns the memory used by a worker: its record and its profile, which is stored twice.
std::size_t MemoryOf(const legopt_msg::hello_request& hello) {
  constexpr std::size_t kFixed = 1000, kCapability = 160;
  std::size_t bytes = kFixed + hello.worker_name.size() + hello.hostname.size() + hello.build.size() +
                      3 * hello.build_id.size() + hello.processor.size();
  for (const legopt_msg::capability& one : hello.capabilities) {
    bytes += kCapability + 2 * (one.name.size() + one.hash.size());
  }
  return bytes;
}

}  // namespace

legopt_msg::hello_reply Scheduler::Hello(const Instant& now, bus::EndpointId sender,
                                         const legopt_msg::hello_request& request, Ops& ops) {
  legopt_msg::hello_reply reply{};
  reply.server_instance = options_.server_instance;
  reply.lease_us = options_.lease.count();
  reply.heartbeat_us = options_.heartbeat.count();
  if (request.protocol_version != bus::kProtocolVersion) {
    reply.status = EnumNumber(HelloStatus::kVersionRefused);
    reply.message = "worker speaks protocol version " + std::to_string(request.protocol_version) + ", server speaks " +
                    std::to_string(bus::kProtocolVersion) + "; run the same release on both";
    return reply;
  }
  Worker& worker = WorkerOf(sender);
  const std::int64_t worker_id = worker.record.worker_id;
  worker.record = {
      worker_id,     sender,           request.worker_name, request.hostname,   request.pid,          request.slots,
      request.build, request.build_id, request.processor,   request.processors, request.memory_bytes, request.load,
      now.wall_us};
  // Refusals stay valid until the worker announces other capabilities: it would refuse the jobs again.
  WorkerCapabilities abilities(request);
  const bool draining = worker.profile.draining;
  if (!(abilities == worker.profile.abilities)) worker.profile = {std::move(abilities), draining, {}};
  worker.leaving = false;
  Hear(worker, now);
  if (!worker.stored) CountNew(worker, MemoryOf(request));
  if (worker.stored) StoreSighting(worker, ops);
  if (worker.stored && !worker.online) {
    ops.emplace_back(db::RecordEvent{"worker_joined", now.wall_us, {}, {}, worker_id, request.worker_name});
  }
  SetOnline(worker, true);
  LimitNewWorkerMemory(worker_id);
  bool same_name = false;
  // A worker that is loading its datasets sends another hello afterwards.
  const std::string mismatch = worker.profile.abilities.HasLoaded() ? MismatchOf(worker, &same_name) : std::string();
  if (same_name) {
    SetOnline(worker, false);  // the worker will exit
    reply.status = EnumNumber(HelloStatus::kDatasetMismatch);
    reply.message = mismatch;
    return reply;
  }
  reply.status = EnumNumber(HelloStatus::kOk);
  reply.worker_id = worker_id;
  reply.message = mismatch;
  return reply;
}

legopt_msg::lease_reply Scheduler::Lease(const Instant& now, bus::EndpointId sender,
                                         const legopt_msg::lease_request& request, Ops& ops) {
  legopt_msg::lease_reply reply{};
  Worker* worker = FindWorker(request.worker_id, sender);
  if (worker == nullptr || !worker->online || request.server_instance != options_.server_instance) {
    reply.status = EnumNumber(LeaseStatus::kUnknownWorker);
    return reply;
  }
  Hear(*worker, now);
  const microseconds idle_retry = std::max(options_.min_retry, options_.retry_per_worker * online_workers_);
  reply.retry_after_us = idle_retry.count();
  if (draining_) {
    reply.status = EnumNumber(LeaseStatus::kNoMoreWork);
    reply.message = "the server is stopping";
    return reply;
  }
  if (worker->profile.draining) {
    reply.status = EnumNumber(LeaseStatus::kNoneNow);
    reply.message = "this worker was asked to leave: 'legopt service drain'";
    return reply;
  }
  const int wanted = BatchSize(request.max_jobs);
  const auto admits = [&](const Experiment& experiment) {
    return [this, worker, &experiment](const Experiment::Group& group) {
      return Admits(worker->profile, experiment, group, Datasets::kPresent);
    };
  };
  const auto can_do = [&](std::int64_t experiment_id) {
    const Experiment& experiment = *open_.at(experiment_id);
    return experiment.HasQueued(admits(experiment));
  };
  constexpr std::int64_t kSearchedAtOnce = 64, kMaxReused = 128;  // numbers of jobs; results are copied in one commit
  constexpr int kMaxSearches = 32;                                // searches of the store per request
  std::int64_t reused = 0;
  int searches = 0;
  // A long job ends a batch, so that a worker that asked for many short jobs does not block long ones that others could
  // start.
  bool full = false;
  while (!full && static_cast<int>(reply.jobs.size()) < wanted) {
    const std::optional<std::int64_t> next = shares_.First(can_do);
    if (!next) break;
    Enlist(now, *worker, ops);
    Experiment& experiment = *open_.at(*next);
    // Reading the store may fail, and then the request is repeated, so no lease may have been granted before.
    if (reply.jobs.empty() && reused < kMaxReused && searches < kMaxSearches) {
      if (const auto jobs = experiment.NextUnsearched(kSearchedAtOnce, admits(experiment)); !jobs.empty()) {
        ++searches;
        reused += ReuseKnownResults(now, experiment, jobs, *worker, ops);
        continue;
      }
    }
    // Jobs that have not been searched are left to the next request.
    const auto index = experiment.TakeQueued([&, admit = admits(experiment)](const Experiment::Group& group) {
      return admit(group) && experiment.IsSearched(group);
    });
    if (!index) break;
    reply.jobs.push_back(LeaseFrom(now, experiment, *index, *worker, ops));
    full = DescriptionOf(experiment.TaskOf(*index)).long_jobs;
  }
  reply.num_jobs = static_cast<std::int32_t>(reply.jobs.size());
  if (!reply.jobs.empty()) {
    reply.status = EnumNumber(LeaseStatus::kLeased);
    return reply;
  }
  if (num_queued() == 0 && num_leases() == 0) {  // a leased job may be re-queued
    reply.status = EnumNumber(LeaseStatus::kNoMoreWork);
    return reply;
  }
  reply.wanted_dataset = WantedDataset(worker->profile);
  if (!reply.wanted_dataset.empty()) {
    reply.status = EnumNumber(LeaseStatus::kNoneNow);
    return reply;
  }
  bool same_name = false;
  reply.message = MismatchOf(*worker, &same_name);
  reply.status = EnumNumber(same_name ? LeaseStatus::kDatasetMismatch : LeaseStatus::kNoneNow);
  return reply;
}

// Near the end of the queue, jobs are spread over the workers: a batch is at most half of the remaining jobs divided by
// the number of slots.
int Scheduler::BatchSize(int wanted) const {
  const std::int64_t share = num_leasable_ / (2 * std::max<std::int64_t>(online_slots_, 1));
  const std::int64_t most = std::min<std::int64_t>(wanted, options_.max_leases_per_request);
  return static_cast<int>(std::clamp<std::int64_t>(share, 1, std::max<std::int64_t>(most, 1)));
}

// Leases a job that was taken from the queue.
legopt_msg::lease Scheduler::LeaseFrom(const Instant& now, Experiment& experiment, std::int64_t index, Worker& worker,
                                       Ops& ops) {
  const ExperimentSpec& spec = experiment.spec();
  Job& job = experiment.job(index);
  ++job.attempts;
  job.token = tokens_();
  job.previous = job.outcome;
  job.outcome = db::AttemptOutcome::kRunning;
  SetJobState(experiment, index, db::JobState::kLeased);
  const std::int64_t job_id = experiment.job_id(index);
  const microseconds expires = now.steady + options_.lease + options_.grace;
  AddLease(experiment, index, {worker.record.worker_id, expires, false, next_order_++, now.steady});
  ++counters_.leases;
  Bind(now, experiment, worker, ops);
  ops.emplace_back(db::LeaseJob{job_id, job.attempts, job.token, worker.record.worker_id, now.wall_us});

  const JobCoordinates at = CoordinatesOf(spec, index);
  legopt_msg::lease lease{};
  lease.job_id = job_id;
  lease.experiment_id = experiment.experiment_id();
  lease.attempt = job.attempts;
  lease.token = job.token;
  lease.lease_us = options_.lease.count();
  lease.dataset_hash = spec.dataset.hash;
  lease.method_hash = spec.methods[at.method].hash;
  lease.task = ToString(spec.tasks[at.task].task);
  lease.initialization = ToString(spec.initializations[at.initialization]);
  lease.problem_id = spec.tasks[at.task].problems[at.problem];
  lease.repetition = static_cast<std::int32_t>(at.repetition);
  lease.experiment_seed = spec.seed;
  lease.effort_limit = spec.tasks[at.task].effort_limit;
  lease.wall_limit_us = spec.tasks[at.task].wall_limit_us;
  lease.memory_limit_bytes = spec.memory_limit_bytes;
  return lease;
}

// The worker of the first job determines the build that finishes the experiment.
void Scheduler::Bind(const Instant& now, Experiment& experiment, const Worker& worker, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  if (summary.control.builds != BuildPolicy::kOne || !summary.control.build_id.empty()) return;
  if (worker.record.build_id.empty()) return;
  summary.control.build_id = worker.record.build_id;
  RecountWorkers(experiment);
  ops.emplace_back(db::ControlExperiment{summary.experiment_id, summary.control});
  ops.emplace_back(db::RecordEvent{"build_chosen",
                                   now.wall_us,
                                   summary.experiment_id,
                                   {},
                                   worker.record.worker_id,
                                   worker.record.build_id + ", " + worker.record.build});
}

legopt_msg::heartbeat_reply Scheduler::Heartbeat(const Instant& now, bus::EndpointId sender,
                                                 const legopt_msg::heartbeat_request& request) {
  ++counters_.heartbeats;
  legopt_msg::heartbeat_reply reply{};
  reply.server_instance = options_.server_instance;
  // After a restart, a worker is identified by its lease tokens until it says hello again.
  Worker* worker = FindWorker(request.worker_id, sender);
  const bool registered = worker != nullptr && worker->online && request.server_instance == options_.server_instance;
  if (worker != nullptr) {
    Hear(*worker, now);
    worker->record.load = request.load;
    worker->leaving = request.leaving != 0;
  }
  const HeartbeatStatus known = registered && worker->profile.draining ? HeartbeatStatus::kDrain : HeartbeatStatus::kOk;
  reply.status = EnumNumber(registered ? known : HeartbeatStatus::kUnknownWorker);
  for (const legopt_msg::lease_state& held : request.leases) {
    const JobRef ref = FindJob(held.job_id);
    const Job* job = ref.experiment == nullptr ? nullptr : &ref.experiment->job(ref.index);
    const bool latest = job != nullptr && job->attempts == held.attempt && job->token == held.token;
    LeaseVerdict verdict = LeaseVerdict::kUnknownLease;
    if (latest && job->state == db::JobState::kLeased) {
      LeaseState& lease = leases_.at(held.job_id);
      lease.expires = now.steady + options_.lease + options_.grace;
      lease.confirmed = true;
      lease.progress_done = held.progress_done;
      lease.progress_total = held.progress_total;
      ++counters_.renewals;
      verdict = LeaseVerdict::kContinue;
    } else if (latest && job->outcome == db::AttemptOutcome::kCancelled) {
      verdict = LeaseVerdict::kCancel;
    } else if (latest && job->outcome == db::AttemptOutcome::kFinished) {
      verdict = LeaseVerdict::kContinue;  // its result has arrived; the acknowledgement is on its way
    } else {
      ++counters_.unknown_leases;
    }
    reply.verdicts.push_back(EnumNumber(verdict));
  }
  reply.num_leases = static_cast<std::int32_t>(reply.verdicts.size());
  return reply;
}

// --- Time ------------------------------------------------------------------------------------------------------------

std::optional<microseconds> Scheduler::next_deadline() const {
  const bool idle = leases_.empty() && open_.empty() && online_workers_ == 0;
  return idle ? std::nullopt : std::optional(next_scan_);
}

void Scheduler::Tick(const Instant& now, Ops& ops) {
  wall_us_ = now.wall_us;
  if (now.steady < next_scan_) return;
  CountWork(now.steady - next_scan_ + options_.expiry_scan);
  next_scan_ = now.steady + options_.expiry_scan;
  ExpireLeases(now, ops);
  UpdateWorkerStates(now, ops);
  // Remove experiments closed long ago. Their rows are committed, so late results are looked up in the store.
  for (auto open = open_.begin(); open != open_.end();) {
    const Experiment& experiment = *open->second;
    if (experiment.closed_at && *experiment.closed_at + options_.retention <= now.steady) {
      by_first_job_.erase(experiment.first_job_id());
      shares_.Remove(open->first);
      open = open_.erase(open);
    } else {
      ++open;
    }
  }
}

// A worker starts its jobs in the order of their leases. Of the unfinished ones, only the first can have started, as
// many as it has slots: these are charged, the others are not.
void Scheduler::ExpireLeases(const Instant& now, Ops& ops) {
  const auto due = [&](const auto& entry) { return entry.second.expires <= now.steady; };
  if (std::none_of(leases_.begin(), leases_.end(), due)) return;
  std::vector<std::pair<std::int64_t, std::int64_t>> in_order;  // order, job
  for (const auto& [job_id, lease] : leases_) in_order.emplace_back(lease.order, job_id);
  std::sort(in_order.begin(), in_order.end());
  std::map<std::int64_t, int> begun;  // worker -> number of its leases so far that may have started
  for (const auto& [order, job_id] : in_order) {
    const LeaseState& lease = leases_.at(job_id);
    const Worker& worker = workers_[lease.worker_id];
    int& rank = begun.try_emplace(lease.worker_id, worker.charged).first->second;
    const bool may_have_begun = rank < worker.record.slots;
    rank += may_have_begun ? 1 : 0;
    if (due(std::pair(job_id, lease))) ExpireLease(now, job_id, may_have_begun, ops);
  }
}

void Scheduler::ExpireLease(const Instant& now, std::int64_t job_id, bool may_have_begun, Ops& ops) {
  const LeaseState lease = leases_.at(job_id);
  const JobRef ref = FindJob(job_id);
  Worker& worker = workers_[lease.worker_id];
  // If a worker is alive but never listed the lease, it did not receive it: the reply was lost, and the job is not at
  // fault.
  const bool never_arrived = !lease.confirmed && worker.online && worker.last_seen + options_.lease > now.steady;
  ++counters_.leases_expired;
  db::EndAttempt end;
  end.job_id = job_id;
  end.attempt = ref.experiment->job(ref.index).attempts;
  const bool charged = !never_arrived && may_have_begun;
  end.outcome = charged ? db::AttemptOutcome::kExpired : db::AttemptOutcome::kReturned;
  worker.charged += charged ? 1 : 0;
  end.message = never_arrived ? "the worker never received the lease"
                              : "lease expired: nothing was heard of worker '" + worker.record.name + "' for " +
                                    std::to_string((options_.lease + options_.grace).count() / 1000) + " ms";
  if (!never_arrived && !may_have_begun) end.message += "; all slots of the worker had earlier jobs";
  const microseconds last_renewal = lease.expires - options_.lease - options_.grace;
  leases_.at(job_id).used_us = charged ? std::max(last_renewal - lease.since, microseconds(0)).count() : 0;
  EndCurrent(now, ref, std::move(end), ops);
}

}  // namespace legopt::server
