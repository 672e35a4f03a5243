// What people decide about experiments after their submission.

#include <utility>

#include "server/scheduler.h"

namespace legopt::server {
namespace {

// control_request.action; the values 0 to 5 are checked by the bus.
enum class Action : std::int8_t { kPause, kResume, kHold, kRelease, kPriority, kRetry };

// Status codes of control_reply.
constexpr std::int32_t kDone = 0;
constexpr std::int32_t kUnknownExperiment = 1;
constexpr std::int32_t kRefused = 2;

legopt_msg::control_reply Answer(std::int32_t status, std::string message) {
  legopt_msg::control_reply reply{};
  reply.status = status;
  reply.message = std::move(message);
  return reply;
}

// What the experiment becomes; empty when it is so already. `*refusal` tells why it cannot be.
std::optional<db::ExperimentControl> NextHold(const db::ExperimentControl& now, Action action,
                                              const std::string& reason, std::string* refusal) {
  db::ExperimentControl next = now;
  next.reason.clear();
  switch (action) {
    case Action::kPause:
      if (now.hold == db::Hold::kHeld) return std::nullopt;  // more than paused
      next.hold = db::Hold::kPaused;
      break;
    case Action::kHold:
      next.hold = db::Hold::kHeld;
      next.reason = reason;
      break;
    case Action::kResume:
      if (now.hold == db::Hold::kHeld) *refusal = "it is held: " + now.reason + "; release it";
      next.hold = db::Hold::kNone;
      break;
    default:
      if (now.hold == db::Hold::kPaused) *refusal = "it is paused, not held; resume it";
      next.hold = db::Hold::kNone;
  }
  if (next == now) return std::nullopt;
  return next;
}

const char* EventOf(Action action) {
  switch (action) {
    case Action::kPause:
      return "experiment_paused";
    case Action::kResume:
      return "experiment_resumed";
    case Action::kHold:
      return "experiment_held";
    default:
      return "experiment_released";
  }
}

}  // namespace

legopt_msg::control_reply Scheduler::Control(const Instant& now, const legopt_msg::control_request& request, Ops& ops) {
  const auto found = summaries_.find(request.experiment_id);
  const std::string name = "experiment " + std::to_string(request.experiment_id);
  if (found == summaries_.end()) return Answer(kUnknownExperiment, "there is no " + name);
  if (static_cast<Action>(request.action) == Action::kRetry) return Retry(now, request.experiment_id, ops);
  if (found->second.state != db::ExperimentState::kActive) {
    return Answer(kRefused, name + " is " + std::string(db::ToString(found->second.state)) + " already");
  }
  if (static_cast<Action>(request.action) == Action::kPriority) return SetPriority(now, request, ops);
  return SetHold(now, request, ops);
}

legopt_msg::control_reply Scheduler::SetHold(const Instant& now, const legopt_msg::control_request& request, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(request.experiment_id);
  const auto action = static_cast<Action>(request.action);
  std::string refusal;
  const auto next = NextHold(summary.control, action, request.reason, &refusal);
  if (!refusal.empty()) {
    return Answer(kRefused, "experiment " + std::to_string(request.experiment_id) + ": " + refusal);
  }
  legopt_msg::control_reply reply = Answer(kDone, "");
  if (!next) {
    reply.message = "experiment " + std::to_string(request.experiment_id) + " is so already";
    return reply;
  }
  summary.control = *next;
  ops.emplace_back(db::ControlExperiment{summary.experiment_id, *next});
  ops.emplace_back(db::RecordEvent{EventOf(action), now.wall_us, summary.experiment_id, {}, {}, request.reason});
  if (action == Action::kHold) {
    reply.num_jobs = GiveBackRunning(now, *open_.at(summary.experiment_id), "held: " + request.reason, ops);
  }
  return reply;
}

// Their workers learn from the next heartbeat that they have lost the leases.
std::int64_t Scheduler::GiveBackRunning(const Instant& now, Experiment& experiment, const std::string& why, Ops& ops) {
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

legopt_msg::control_reply Scheduler::SetPriority(const Instant& now, const legopt_msg::control_request& request,
                                                 Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(request.experiment_id);
  if (summary.control.priority == request.priority) return Answer(kDone, "it has this priority already");
  auto entry = by_urgency_.extract({-summary.control.priority, summary.experiment_id});
  summary.control.priority = request.priority;
  entry.key() = {-request.priority, summary.experiment_id};
  by_urgency_.insert(std::move(entry));
  ops.emplace_back(db::ControlExperiment{summary.experiment_id, summary.control});
  ops.emplace_back(db::RecordEvent{
      "experiment_priority", now.wall_us, summary.experiment_id, {}, {}, std::to_string(request.priority)});
  return Answer(kDone, "");
}

// Idempotent: what was queued again is neither failed nor dead when this is heard twice.
legopt_msg::control_reply Scheduler::Retry(const Instant& now, std::int64_t experiment_id, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(experiment_id);
  if (summary.state == db::ExperimentState::kCancelled) {
    return Answer(kRefused, "experiment " + std::to_string(experiment_id) + " was cancelled; submit it as a new one");
  }
  legopt_msg::control_reply reply = Answer(kDone, "");
  const auto count = [&summary](db::JobState state) { return summary.jobs_by_state[static_cast<int>(state)]; };
  reply.num_jobs = count(db::JobState::kFailed) + count(db::JobState::kDead);
  if (reply.num_jobs == 0) {
    reply.message = "no job of experiment " + std::to_string(experiment_id) + " has failed or died";
    return reply;
  }
  if (!open_.contains(experiment_id)) Open(now, lookup_.experiment(experiment_id).value());
  Experiment& experiment = *open_.at(experiment_id);
  for (std::int64_t index = 0; index < experiment.num_jobs(); ++index) {
    Job& job = experiment.job(index);
    if (job.state != db::JobState::kFailed && job.state != db::JobState::kDead) continue;
    job.returned = job.attempts;
    SetJobState(experiment, job, db::JobState::kQueued);
    experiment.PutBack(index);
  }
  summary.state = db::ExperimentState::kActive;
  summary.finished_at_us = 0;
  experiment.closed_at.reset();
  counters_.jobs_retried += static_cast<std::uint64_t>(reply.num_jobs);
  ops.emplace_back(db::RetryExperiment{experiment_id});
  ops.emplace_back(db::RecordEvent{"experiment_retried", now.wall_us, experiment_id, {}, {}, {}});
  return reply;
}

}  // namespace legopt::server
