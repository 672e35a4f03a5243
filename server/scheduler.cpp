#include "server/scheduler.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "bus/messages.h"
#include "legopt/input/json.h"
#include "legopt/types/reply.h"

namespace legopt::server {
namespace {

std::int64_t& CountOf(db::ExperimentSummary& summary, db::JobState state) { return summary.jobs_by_state[state]; }

// Names are for tables only; they affect neither options nor hash.
std::string WithoutName(const std::string& options_json) {
  auto options = TryParseJson(options_json);
  if (!options || !options->is_object()) return options_json;
  options->erase("name");
  return Dump(*options);
}

}  // namespace

Scheduler::Scheduler(const SchedulerOptions& options, db::OpenState state, TokenSource tokens, Lookup lookup,
                     const Instant& now)
    : options_(options),
      tokens_(std::move(tokens)),
      lookup_(std::move(lookup)),
      next_experiment_id_(state.next_experiment_id),
      next_job_id_(state.next_job_id),
      next_cell_id_(state.next_cell_id),
      next_worker_id_(state.next_worker_id),
      controls_(options.control_burst, options.controls_per_s) {
  for (db::ExperimentSummary& summary : state.experiments) {
    submissions_.emplace(summary.submission_id, summary.experiment_id);
    summary_bytes_ += SummaryBytes(summary);
    summaries_.emplace(summary.experiment_id, std::move(summary));
  }
  for (auto& [id, record] : state.workers) {
    worker_of_endpoint_.emplace(record.endpoint, id);
    Worker& worker = workers_[id];
    worker.record = std::move(record);
    worker.stored = true;
  }
  for (const db::OpenExperiment& open : state.open) Open(now, open);
  EvictOfflineWorkers();
  next_scan_ = now.steady + options_.expiry_scan;
  wall_us_ = now.wall_us;
}

// Restores an experiment from the store.
void Scheduler::Open(const Instant& now, const db::OpenExperiment& open) {
  const db::ExperimentSummary& summary = summaries_.at(open.experiment_id);
  auto owned = std::make_unique<Experiment>(open.experiment_id, summary.first_job_id, ParseSpec(open.spec_json));
  if (owned->num_jobs() != static_cast<std::int64_t>(open.jobs.size())) {
    throw SpecError("experiment " + std::to_string(open.experiment_id) + " is stored with another number of jobs");
  }
  Experiment& experiment = *owned;
  UpdateOffered(experiment.spec().dataset.hash);
  AddOpen(std::move(owned));
  for (std::int64_t index = 0; index < experiment.num_jobs(); ++index) {
    const db::OpenJob& stored = open.jobs[static_cast<std::size_t>(index)];
    Job& job = experiment.job(index);
    job.token = stored.token;
    job.attempts = static_cast<std::uint16_t>(stored.attempts);
    job.returned = static_cast<std::uint16_t>(stored.returned);
    job.state = stored.state;
    job.outcome = stored.outcome;
    job.time_limited = stored.time_limited;
    job.solved = stored.solved;
    if (stored.state != db::JobState::kQueued) experiment.CountQueued(index, -1);
    if (stored.state != db::JobState::kLeased) continue;
    // The worker may still be running the job. The lease is shorter than a full one, because a server that restarts
    // repeatedly would otherwise keep the jobs of dead workers leased forever.
    const microseconds expires = now.steady + options_.lease * 9 / 10;
    AddLease(experiment, index, {stored.worker_id, expires, false, next_order_++, now.steady});
  }
  experiment.RestoreTimes(open);
  num_queued_ += CountOf(summaries_.at(open.experiment_id), db::JobState::kQueued);
  UpdateWaiting(experiment);
}

// Its jobs are not scheduled before UpdateWaiting is called.
void Scheduler::AddOpen(std::unique_ptr<Experiment> experiment) {
  const std::int64_t id = experiment->experiment_id();
  const ExperimentSpec& spec = experiment->spec();
  shares_.Add(id, spec.submitter, summaries_.at(id).control.priority, spec.dataset.hash);
  by_first_job_[experiment->first_job_id()] = experiment.get();
  open_[id] = std::move(experiment);
  RecountWorkers(*open_[id]);
}

// --- Experiments -----------------------------------------------------------------------------------------------------

legopt_msg::submit_reply Scheduler::Submit(const Instant& now, const legopt_msg::submit_request& request, Ops& ops) {
  legopt_msg::submit_reply reply{};
  const auto refuse = [&](const std::string& why) {
    ++counters_.submissions_refused;
    reply.status = EnumNumber(SubmitStatus::kRefused);
    reply.message = why;
    return reply;
  };
  ExperimentSpec spec;
  try {
    spec = ParseSpec(request.spec_json);
  } catch (const SpecError& error) {
    return refuse(error.what());
  }
  if (const auto known = submissions_.find(request.submission_id); known != submissions_.end()) {
    const db::ExperimentSummary& summary = summaries_.at(known->second);
    if (summary.spec_hash != spec.hash) {
      return refuse("submission id '" + request.submission_id + "' was used for experiment " +
                    std::to_string(known->second) + " with another content; use a new id");
    }
    ++counters_.resubmitted;
    reply.status = EnumNumber(SubmitStatus::kAlreadyKnown);
    reply.experiment_id = known->second;
    reply.num_jobs = summary.num_jobs;
    return reply;
  }
  for (const db::MethodRecord& method : spec.methods) {
    const auto options = lookup_.method_options(method.hash);
    if (options && WithoutName(*options) != WithoutName(method.options_json)) {
      return refuse("method '" + method.name + "': hash " + method.hash + " stands for other options already");
    }
  }
  if (const std::string why = OverBudget(spec); !why.empty()) return refuse(why);
  UpdateOffered(spec.dataset.hash);
  db::NewExperiment rows = MakeNewExperiment(spec, next_experiment_id_++, next_job_id_, next_cell_id_);
  rows.submission_id = request.submission_id;
  rows.submitted_at_us = now.wall_us;
  next_job_id_ += spec.num_jobs();
  next_cell_id_ += static_cast<std::int64_t>(rows.cells.size());
  AddExperiment(rows, std::move(spec));
  ++counters_.submitted;
  reply.status = EnumNumber(SubmitStatus::kCreated);
  reply.experiment_id = rows.experiment_id;
  reply.num_jobs = static_cast<std::int64_t>(rows.jobs.size());
  ops.emplace_back(db::CreateExperiment{std::move(rows)});
  ops.emplace_back(db::RecordEvent{"experiment_submitted", now.wall_us, reply.experiment_id, {}, {}, {}});
  return reply;
}

void Scheduler::AddExperiment(const db::NewExperiment& rows, ExperimentSpec spec) {
  db::ExperimentSummary summary;
  summary.experiment_id = rows.experiment_id;
  summary.submission_id = rows.submission_id;
  summary.name = spec.name;
  summary.spec_hash = spec.hash;
  summary.submitter = spec.submitter;
  summary.rule = spec.rule;
  summary.control.builds = spec.builds;
  summary.dataset = spec.dataset.name;
  for (const db::MethodRecord& method : spec.methods) {
    auto& names = summary.methods;
    if (std::find(names.begin(), names.end(), method.name) == names.end()) names.push_back(method.name);
  }
  summary.first_job_id = rows.jobs.front().job_id;
  summary.num_jobs = spec.num_jobs();
  summary.submitted_at_us = rows.submitted_at_us;
  CountOf(summary, db::JobState::kQueued) = summary.num_jobs;
  num_queued_ += summary.num_jobs;
  submissions_[summary.submission_id] = rows.experiment_id;
  const std::int64_t first_job_id = summary.first_job_id;
  summary_bytes_ += SummaryBytes(summary);
  summaries_[rows.experiment_id] = std::move(summary);
  AddOpen(std::make_unique<Experiment>(rows.experiment_id, first_job_id, std::move(spec)));
  UpdateWaiting(*open_.at(rows.experiment_id));
}

legopt_msg::cancel_reply Scheduler::Cancel(const Instant& now, const legopt_msg::cancel_request& request, Ops& ops) {
  legopt_msg::cancel_reply reply{};
  const auto found = summaries_.find(request.experiment_id);
  if (found == summaries_.end()) {
    reply.status = EnumNumber(ControlStatus::kUnknownExperiment);
    reply.message = "there is no experiment " + std::to_string(request.experiment_id);
    return reply;
  }
  if (found->second.state != db::ExperimentState::kActive) {
    // A repeated or late request: nothing is left to cancel, so the caller's goal is reached.
    reply.message = "experiment " + std::to_string(request.experiment_id) + " is " +
                    std::string(ToString(found->second.state)) + " already";
    return reply;
  }
  Experiment& experiment = *open_.at(request.experiment_id);
  for (std::int64_t index = 0; index < experiment.num_jobs(); ++index) {
    Job& job = experiment.job(index);
    if (db::IsTerminal(job.state)) continue;
    if (job.state == db::JobState::kLeased) {
      job.outcome = db::AttemptOutcome::kCancelled;
      DropLease(now, {&experiment, index});
    }
    SetJobState(experiment, index, db::JobState::kCancelled);
    ++reply.num_jobs;
  }
  counters_.jobs_cancelled += static_cast<std::uint64_t>(reply.num_jobs);
  Close(now, experiment, db::ExperimentState::kCancelled);
  ops.emplace_back(db::CancelExperiment{request.experiment_id, now.wall_us});
  ops.emplace_back(db::RecordEvent{"experiment_cancelled", now.wall_us, request.experiment_id, {}, {}, {}});
  return reply;
}

// Ends a pause, so that a retried experiment is not paused.
void Scheduler::Close(const Instant& now, Experiment& experiment, db::ExperimentState state) {
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  summary.state = state;
  summary.finished_at_us = now.wall_us;
  summary.control.hold = db::ExperimentHold::kNone;
  summary_bytes_ -= summary.control.reason.size();
  summary.control.reason.clear();
  experiment.closed_at = now.steady;
}

void Scheduler::FinishIfComplete(const Instant& now, Experiment& experiment, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  const std::int64_t left = CountOf(summary, db::JobState::kQueued) + CountOf(summary, db::JobState::kLeased);
  if (left > 0 || summary.state != db::ExperimentState::kActive) return;
  Close(now, experiment, db::ExperimentState::kDone);
  ops.emplace_back(db::FinishExperiment{summary.experiment_id, now.wall_us});
  ops.emplace_back(db::RecordEvent{"experiment_finished", now.wall_us, summary.experiment_id, {}, {}, {}});
}

// --- Small functions -------------------------------------------------------------------------------------------------

Scheduler::Worker* Scheduler::FindWorker(std::int64_t worker_id, bus::EndpointId sender) {
  const auto found = workers_.find(worker_id);
  return found == workers_.end() || found->second.record.endpoint != sender ? nullptr : &found->second;
}

void Scheduler::Hear(Worker& worker, const Instant& now) {
  worker.last_seen = now.steady;
  worker.record.seen_at_us = now.wall_us;
  wall_us_ = now.wall_us;
  worker.charged = 0;
}

Scheduler::JobRef Scheduler::FindJob(std::int64_t job_id) {
  auto after = by_first_job_.upper_bound(job_id);
  if (after == by_first_job_.begin()) return {};
  Experiment* experiment = std::prev(after)->second;
  const std::int64_t index = job_id - experiment->first_job_id();
  return index < experiment->num_jobs() ? JobRef{experiment, index} : JobRef{};
}

void Scheduler::SetJobState(Experiment& experiment, std::int64_t index, db::JobState state) {
  Job& job = experiment.job(index);
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  --CountOf(summary, job.state);
  ++CountOf(summary, state);
  const int change = (state == db::JobState::kQueued ? 1 : 0) - (job.state == db::JobState::kQueued ? 1 : 0);
  num_queued_ += change;
  experiment.CountQueued(index, change);
  job.state = state;
  UpdateWaiting(experiment);
}

// Must be called whenever the number of queued jobs changes, or whether they can be leased: paused, or without able
// workers.
void Scheduler::UpdateWaiting(Experiment& experiment) {
  const bool free = summaries_.at(experiment.experiment_id()).control.hold == db::ExperimentHold::kNone;
  const std::int64_t leasable = free ? experiment.num_takable() : 0;
  num_leasable_ += leasable - experiment.leasable;
  experiment.leasable = leasable;
  shares_.SetWaiting(experiment.experiment_id(), leasable > 0);
}

void Scheduler::AddLease(Experiment& experiment, std::int64_t index, LeaseState lease) {
  lease.expected_us = experiment.ExpectedUse_us(index);
  shares_.Begin(experiment.experiment_id(), lease.expected_us);
  ++workers_[lease.worker_id].leases;
  leases_[experiment.job_id(index)] = std::move(lease);
}

// If the worker reported no CPU time, the time since the lease was granted is used, including waiting for a slot. The
// time is limited to the wall-time limit of the job.
void Scheduler::DropLease(const Instant& now, const JobRef& ref) {
  constexpr std::int64_t kMinUse_us = 100;  // minimum charge: the cost of a lease, so that jobs without work take
                                            // turns as well
  const auto found = leases_.find(ref.experiment->job_id(ref.index));
  if (found == leases_.end()) return;
  const LeaseState lease = found->second;
  leases_.erase(found);
  --workers_[lease.worker_id].leases;
  const std::int64_t reported_us = lease.used_us.value_or((now.steady - lease.since).count());
  const JobCoordinates at = CoordinatesOf(ref.experiment->spec(), ref.index);
  const std::int64_t most_us = ref.experiment->spec().tasks[at.task].wall_limit_us;
  const std::int64_t used_us = std::max(std::min(reported_us, most_us), kMinUse_us);
  shares_.End(ref.experiment->experiment_id(), lease.expected_us, used_us);
  if (ref.experiment->job(ref.index).outcome == db::AttemptOutcome::kFinished) {
    ref.experiment->NoteUse(ref.index, used_us);
  }
}

std::vector<std::pair<std::string_view, std::uint64_t>> SchedulerCounters::Listing() const {
  return {{"submitted", submitted},
          {"resubmitted", resubmitted},
          {"submissions_refused", submissions_refused},
          {"leases", leases},
          {"heartbeats", heartbeats},
          {"renewals", renewals},
          {"unknown_leases", unknown_leases},
          {"leases_expired", leases_expired},
          {"results_accepted", results_accepted},
          {"results_duplicate", results_duplicate},
          {"results_stale", results_stale},
          {"results_refused", results_refused},
          {"attempts_failed", attempts_failed},
          {"attempts_returned", attempts_returned},
          {"attempts_refused", attempts_refused},
          {"jobs_dead", jobs_dead},
          {"jobs_failed", jobs_failed},
          {"jobs_cancelled", jobs_cancelled},
          {"jobs_retried", jobs_retried},
          {"jobs_deleted", jobs_deleted},
          {"results_taken_over", results_taken_over}};
}

// Read access to the scheduler's state.

std::vector<JobProgress> Scheduler::Progress(std::int64_t experiment_id, std::size_t most) const {
  std::vector<JobProgress> list;
  const auto open = open_.find(experiment_id);
  if (open == open_.end()) return list;
  const Experiment& experiment = *open->second;
  const std::int64_t first = experiment.first_job_id();
  const auto end = leases_.lower_bound(first + experiment.num_jobs());
  for (auto lease = leases_.lower_bound(first); lease != end && list.size() < most; ++lease) {
    const LeaseState& state = lease->second;
    if (state.progress_total == 0) continue;
    list.push_back({lease->first, experiment.TaskOf(lease->first - first), state.worker_id, state.progress_done,
                    state.progress_total});
  }
  return list;
}

std::vector<LeaseView> Scheduler::LeasesInOrder() const {
  std::vector<std::pair<std::int64_t, std::int64_t>> in_order;  // order, job
  for (const auto& [job_id, lease] : leases_) in_order.emplace_back(lease.order, job_id);
  std::sort(in_order.begin(), in_order.end());
  std::vector<LeaseView> views;
  for (const auto& [order, job_id] : in_order) {
    const LeaseState& lease = leases_.at(job_id);
    const Experiment* experiment = std::prev(by_first_job_.upper_bound(job_id))->second;
    views.push_back(
        {job_id, experiment->experiment_id(), lease.worker_id, lease.since, lease.progress_done, lease.progress_total});
  }
  return views;
}

// Workers choose a new identity at every start, so offline ones accumulate.
std::vector<WorkerStatus> Scheduler::workers() const {
  std::vector<std::pair<std::int64_t, std::int64_t>> gone;  // last seen, id
  std::set<std::int64_t> shown;
  for (const auto& [id, worker] : workers_) {
    if (worker.online || worker.leases > 0) {
      shown.insert(id);
    } else if (worker.record.seen_at_us > wall_us_ - options_.offline_shown.count()) {
      gone.emplace_back(worker.record.seen_at_us, id);
    }
  }
  std::sort(gone.rbegin(), gone.rend());
  gone.resize(std::min(gone.size(), options_.most_offline_shown));
  for (const auto& [seen, id] : gone) shown.insert(id);
  std::vector<WorkerStatus> list;
  for (const std::int64_t id : shown) {
    const Worker& worker = workers_.at(id);
    list.push_back({worker.record, worker.online, worker.last_seen, worker.leases, worker.profile, worker.stored});
  }
  return list;
}

std::optional<microseconds> Scheduler::oldest_lease() const {
  std::optional<microseconds> oldest;
  for (const auto& [job_id, lease] : leases_) oldest = oldest ? std::min(*oldest, lease.since) : lease.since;
  return oldest;
}

const Experiment* Scheduler::InMemory(std::int64_t experiment_id) const {
  const auto open = open_.find(experiment_id);
  return open == open_.end() ? nullptr : open->second.get();
}

// A late tick (no work to do, or a store error) does not show how long the jobs ran since the previous tick.
void Scheduler::CountWork(microseconds elapsed) {
  constexpr microseconds kLongest = std::chrono::seconds(1);
  for (const auto& [id, experiment] : open_) {
    const std::int64_t leased = summaries_.at(id).jobs_by_state[db::JobState::kLeased];
    if (leased > 0) experiment->worked += std::min(elapsed, kLongest);
  }
}

}  // namespace legopt::server
