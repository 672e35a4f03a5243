// Changes that users make to submitted experiments.

#include <utility>

#include "legopt/input/text.h"
#include "legopt/types/reply.h"
#include "server/scheduler.h"

namespace legopt::server {
namespace {

// Returns the error of the stored form, or else that of the naming rule.
std::string FirstNameError(const std::string& name, const std::string& fault) {
  if (!fault.empty()) return fault;
  const auto unfit = DiagnoseName(name);
  return unfit ? unfit->message : "";
}

constexpr std::size_t kMaxTags = 100;  // per experiment

legopt_msg::control_reply Answer(ControlStatus status, std::string message) {
  legopt_msg::control_reply reply{};
  reply.status = EnumNumber(status);
  reply.message = std::move(message);
  return reply;
}

std::string NameOf(const legopt_msg::control_request& request) {
  return "experiment " + std::to_string(request.experiment_id);
}

// Returns the control settings after an action that pauses or resumes. A pause without a reason keeps an earlier one.
db::ExperimentControl NextControl(const db::ExperimentControl& now, ControlAction action, const std::string& reason) {
  db::ExperimentControl next = now;
  if (action == ControlAction::kPause || action == ControlAction::kPauseNow) {
    next.hold = db::ExperimentHold::kPaused;
    if (!reason.empty()) next.reason = reason;
    return next;
  }
  next.hold = db::ExperimentHold::kNone;
  next.reason.clear();
  if (action == ControlAction::kResumeAnyBuild) next.builds = BuildPolicy::kAny;
  return next;
}

}  // namespace

legopt_msg::control_reply Scheduler::Control(const Instant& now, const legopt_msg::control_request& request, Ops& ops) {
  const auto action = ControlAction{request.action};
  if (action == ControlAction::kDrainWorker) return DrainWorker(now, request.experiment_id, ops);
  const auto found = summaries_.find(request.experiment_id);
  if (found == summaries_.end()) {
    // Numbers are assigned in ascending order and never reused, so this experiment existed.
    const bool was_there = request.experiment_id < next_experiment_id_;
    if (was_there && action == ControlAction::kDelete)
      return Answer(ControlStatus::kOk, NameOf(request) + " was deleted already");
    return Answer(ControlStatus::kUnknownExperiment,
                  was_there ? NameOf(request) + " was deleted" : "there is no " + NameOf(request));
  }
  switch (action) {
    case ControlAction::kRetry:
    case ControlAction::kRetryTimeLimits:
      return Retry(now, request.experiment_id, action == ControlAction::kRetryTimeLimits, ops);
    case ControlAction::kRename:
      return Rename(now, request, ops);
    case ControlAction::kTag:
    case ControlAction::kUntag:
      return SetTag(request, ops);
    case ControlAction::kDelete:
      return Delete(now, request.experiment_id, ops);
    default:
      break;
  }
  if (found->second.state != db::ExperimentState::kActive) {
    return Answer(ControlStatus::kRefused,
                  NameOf(request) + " is " + std::string(ToString(found->second.state)) + " already");
  }
  if (action == ControlAction::kRelease) {
    return Answer(ControlStatus::kRefused,
                  NameOf(request) + ": the action 'release' is not served any more; resume it");
  }
  if (action == ControlAction::kPriority) return SetPriority(now, request, ops);
  return SetHold(now, request, ops);
}

legopt_msg::control_reply Scheduler::SetHold(const Instant& now, const legopt_msg::control_request& request, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(request.experiment_id);
  Experiment& experiment = *open_.at(summary.experiment_id);
  const auto action = ControlAction{request.action};
  const db::ExperimentControl next = NextControl(summary.control, action, request.reason);
  const bool stops_jobs = action == ControlAction::kPauseNow && RunsJobs(experiment);
  if (next == summary.control && !stops_jobs) {
    const bool paused = next.hold == db::ExperimentHold::kPaused;
    return Answer(ControlStatus::kOk, NameOf(request) + (paused ? " was paused already" : " was not paused"));
  }
  if (const std::string why = OverControlRate(now); !why.empty()) return Answer(ControlStatus::kRefused, why);
  summary_bytes_ -= SummaryBytes(summary);
  summary.control = next;
  summary_bytes_ += SummaryBytes(summary);
  if (action == ControlAction::kResumeAnyBuild) RecountWorkers(experiment);
  UpdateWaiting(experiment);
  const bool paused = next.hold == db::ExperimentHold::kPaused;
  ops.emplace_back(db::ControlExperiment{summary.experiment_id, next});
  ops.emplace_back(db::RecordEvent{
      paused ? "experiment_paused" : "experiment_resumed", now.wall_us, summary.experiment_id, {}, {}, next.reason});
  legopt_msg::control_reply reply = Answer(ControlStatus::kOk, "");
  if (stops_jobs) {
    reply.num_jobs = RequeueRunning(now, experiment, next.reason.empty() ? "paused" : "paused: " + next.reason, ops);
  }
  return reply;
}

bool Scheduler::RunsJobs(const Experiment& experiment) {
  for (std::int64_t index = 0; index < experiment.num_jobs(); ++index) {
    if (experiment.job(index).state == db::JobState::kLeased) return true;
  }
  return false;
}

// The workers learn of the lost leases with the next heartbeat.
std::int64_t Scheduler::RequeueRunning(const Instant& now, Experiment& experiment, const std::string& why, Ops& ops) {
  std::int64_t given_back = 0;
  for (std::int64_t index = 0; index < experiment.num_jobs(); ++index) {
    if (experiment.job(index).state != db::JobState::kLeased) continue;
    db::EndAttempt end;
    end.job_id = experiment.job_id(index);
    end.attempt = experiment.job(index).attempts;
    end.outcome = db::AttemptOutcome::kReturned;
    end.message = why;
    EndCurrent(now, {&experiment, index}, std::move(end), ops);
    ++given_back;
  }
  return given_back;
}

void Scheduler::RequeueAllRunning(const Instant& now, const std::string& why, Ops& ops) {
  for (const auto& [id, experiment] : open_) RequeueRunning(now, *experiment, why, ops);
}

legopt_msg::control_reply Scheduler::SetPriority(const Instant& now, const legopt_msg::control_request& request,
                                                 Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(request.experiment_id);
  if (summary.control.priority == request.priority) return Answer(ControlStatus::kOk, "it has this priority already");
  if (const std::string why = OverControlRate(now); !why.empty()) return Answer(ControlStatus::kRefused, why);
  summary.control.priority = request.priority;
  shares_.SetPriority(summary.experiment_id, request.priority);
  ops.emplace_back(db::ControlExperiment{summary.experiment_id, summary.control});
  ops.emplace_back(db::RecordEvent{
      "experiment_priority", now.wall_us, summary.experiment_id, {}, {}, std::to_string(request.priority)});
  return Answer(ControlStatus::kOk, "");
}

// Idempotent: jobs re-queued by a first request are not terminal when the request is repeated.
legopt_msg::control_reply Scheduler::Retry(const Instant& now, std::int64_t experiment_id, bool time_limited,
                                           Ops& ops) {
  const std::string name = "experiment " + std::to_string(experiment_id);
  db::ExperimentSummary& summary = summaries_.at(experiment_id);
  if (summary.state == db::ExperimentState::kCancelled) {
    return Answer(ControlStatus::kRefused, name + " was cancelled; submit it as a new one");
  }
  if (const std::string why = OverControlRate(now); !why.empty()) return Answer(ControlStatus::kRefused, why);
  legopt_msg::control_reply reply = Answer(ControlStatus::kOk, "");
  const auto count = [&summary](db::JobState state) { return summary.jobs_by_state[state]; };
  const bool none_failed = count(db::JobState::kFailed) + count(db::JobState::kDead) == 0;
  if (!none_failed || time_limited) {
    if (!open_.contains(experiment_id)) {
      Open(now, lookup_.experiment(experiment_id).value());
      open_.at(experiment_id)->closed_at = now.steady;
    }
    reply.num_jobs = QueueAgain(*open_.at(experiment_id), time_limited);
  }
  if (reply.num_jobs == 0) {
    reply.message = "no job of " + name + " has failed or died" + (time_limited ? ", or was stopped by the clock" : "");
    return reply;
  }
  summary.state = db::ExperimentState::kActive;
  summary.finished_at_us = 0;
  open_.at(experiment_id)->closed_at.reset();
  counters_.jobs_retried += static_cast<std::uint64_t>(reply.num_jobs);
  ops.emplace_back(db::RetryExperiment{experiment_id, time_limited, now.wall_us});
  ops.emplace_back(db::RecordEvent{"experiment_retried", now.wall_us, experiment_id, {}, {}, {}});
  return reply;
}

// Re-queues failed and dead jobs and, with `time_limited`, jobs stopped by the wall-time limit, whose results no longer
// count. Returns their number.
std::int64_t Scheduler::QueueAgain(Experiment& experiment, bool time_limited) {
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  std::int64_t queued = 0;
  for (std::int64_t index = 0; index < experiment.num_jobs(); ++index) {
    Job& job = experiment.job(index);
    const bool failed = job.state == db::JobState::kFailed || job.state == db::JobState::kDead;
    if (!failed && !(time_limited && job.time_limited)) continue;
    if (job.solved) --summary.solved;
    job.solved = job.time_limited = false;
    job.fault_signal = 0;
    job.returned = job.attempts;
    SetJobState(experiment, index, db::JobState::kQueued);
    experiment.PutBack(index);
    ++queued;
  }
  return queued;
}

legopt_msg::control_reply Scheduler::Rename(const Instant& now, const legopt_msg::control_request& request, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(request.experiment_id);
  if (const std::string fault = FirstNameError(request.reason, db::ValidateName(request.reason)); !fault.empty()) {
    return Answer(ControlStatus::kRefused, "the name of an experiment " + fault);
  }
  if (summary.name == request.reason) return Answer(ControlStatus::kOk, NameOf(request) + " has this name already");
  if (const std::string why = OverControlRate(now); !why.empty()) return Answer(ControlStatus::kRefused, why);
  ops.emplace_back(db::RenameExperiment{summary.experiment_id, request.reason});
  ops.emplace_back(db::RecordEvent{"experiment_renamed", now.wall_us, summary.experiment_id, {}, {}, summary.name});
  summary_bytes_ -= SummaryBytes(summary);
  summary.name = request.reason;
  summary_bytes_ += SummaryBytes(summary);
  return Answer(ControlStatus::kOk, "");
}

legopt_msg::control_reply Scheduler::SetTag(const legopt_msg::control_request& request, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(request.experiment_id);
  const bool set = ControlAction{request.action} == ControlAction::kTag;
  const std::string& tag = request.reason;
  if (const std::string fault = set ? FirstNameError(tag, db::ValidateTag(tag)) : db::ValidateTag(tag); !fault.empty())
    return Answer(ControlStatus::kRefused, "a tag " + fault);
  if (summary.tags.contains(tag) == set) {
    return Answer(ControlStatus::kOk, NameOf(request) + (set ? " has this tag already" : " does not have this tag"));
  }
  if (set && summary.tags.size() >= kMaxTags) {
    return Answer(ControlStatus::kRefused,
                  NameOf(request) + " has " + std::to_string(kMaxTags) + " tags, as many as may be");
  }
  if (set && summary_bytes_ >= options_.max_summary_bytes) {
    return Answer(ControlStatus::kRefused, "the names, methods and tags of all experiments take " +
                                               std::to_string(options_.max_summary_bytes >> 20U) +
                                               " MiB, which is the most; delete experiments ('legopt service delete')");
  }
  summary_bytes_ -= SummaryBytes(summary);
  if (set) {
    summary.tags.insert(tag);
  } else {
    summary.tags.erase(tag);
  }
  summary_bytes_ += SummaryBytes(summary);
  ops.emplace_back(db::TagExperiment{summary.experiment_id, tag, set});
  return Answer(ControlStatus::kOk, "");
}

// The worker is informed by its next heartbeat reply. Jobs that are running there may finish.
legopt_msg::control_reply Scheduler::DrainWorker(const Instant& now, std::int64_t worker_id, Ops& ops) {
  const auto found = workers_.find(worker_id);
  const std::string name = "worker " + std::to_string(worker_id);
  if (found == workers_.end()) return Answer(ControlStatus::kUnknownExperiment, "there is no " + name);
  Worker& worker = found->second;
  if (!worker.online) return Answer(ControlStatus::kRefused, name + " is not connected");
  legopt_msg::control_reply reply = Answer(ControlStatus::kOk, "");
  reply.num_jobs = worker.leases;
  if (std::exchange(worker.profile.draining, true)) {
    reply.message = name + " drains already";
    return reply;
  }
  SetOnline(worker, true);
  if (!worker.stored) return reply;  // no row to which the event could refer
  ops.emplace_back(db::RecordEvent{"worker_draining", now.wall_us, {}, {}, worker_id, worker.record.name});
  return reply;
}

// Merges adjacent ranges, so that alternating submissions and deletions do not use up memory.
void Scheduler::NoteDeleted(std::int64_t first, std::int64_t end) {
  auto after = deleted_jobs_.upper_bound(first);
  if (after != deleted_jobs_.end() && after->first == end) {
    end = after->second;
    after = deleted_jobs_.erase(after);
  }
  if (after != deleted_jobs_.begin() && std::prev(after)->second == first) {
    std::prev(after)->second = end;
  } else {
    deleted_jobs_.emplace(first, end);
  }
}

// The experiment has no leases. Late reports find no job; its ids are never reused.
legopt_msg::control_reply Scheduler::Delete(const Instant& now, std::int64_t id, Ops& ops) {
  const auto found = summaries_.find(id);
  const db::ExperimentSummary& summary = found->second;
  const std::string name = "experiment " + std::to_string(id);
  if (summary.state == db::ExperimentState::kActive)
    return Answer(ControlStatus::kRefused, name + " is active; cancel it first");
  if (const std::string why = OverControlRate(now); !why.empty()) return Answer(ControlStatus::kRefused, why);
  legopt_msg::control_reply reply = Answer(ControlStatus::kOk, "");
  reply.num_jobs = summary.num_jobs;
  counters_.jobs_deleted += static_cast<std::uint64_t>(summary.num_jobs);
  ops.emplace_back(db::DeleteExperiment{id});
  ops.emplace_back(
      db::RecordEvent{"experiment_deleted", now.wall_us, {}, {}, {}, std::to_string(id) + " " + summary.name});
  NoteDeleted(summary.first_job_id, summary.first_job_id + summary.num_jobs);
  summary_bytes_ -= SummaryBytes(summary);
  by_first_job_.erase(summary.first_job_id);
  shares_.Remove(id);
  open_.erase(id);
  submissions_.erase(summary.submission_id);
  summaries_.erase(found);
  return reply;
}

}  // namespace legopt::server
