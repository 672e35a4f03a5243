#include <utility>

#include "server/scheduler.h"

namespace legopt::server {
namespace {

// Status codes of result_reply.
constexpr std::int32_t kAccepted = 0;
constexpr std::int32_t kDuplicate = 1;
constexpr std::int32_t kStale = 2;
constexpr std::int32_t kRefused = 3;

// result_request.outcome; the values 0 to 5 are checked by the bus.
db::AttemptOutcome OutcomeOf(const legopt_msg::result_request& request) {
  switch (request.outcome) {
    case 0:
      return db::AttemptOutcome::kFinished;
    case 1:
      return db::AttemptOutcome::kCrashed;
    case 2:
      return db::AttemptOutcome::kTimeLimit;
    case 3:
      return db::AttemptOutcome::kMemoryLimit;
    case 4:
      return db::AttemptOutcome::kCancelled;
    default:
      return db::AttemptOutcome::kError;
  }
}

db::ResultRecord RecordOf(const legopt_msg::result_request& request) {
  db::ResultRecord record;
  record.solver_status = request.solver_status;
  record.iterations = request.iterations;
  record.restarts = request.restarts;
  record.wall_us = request.wall_us;
  record.cpu_us = request.cpu_us;
  record.involuntary_context_switches = request.involuntary_context_switches;
  record.peak_memory_bytes = request.peak_memory_bytes;
  record.solver_cost = request.solver_cost;
  record.solver_violation = request.solver_violation;
  record.verdict_literal = request.verdict_literal;
  record.verdict_strict = request.verdict_strict;
  record.verdict_detail = request.verdict_detail;
  record.failed_waypoint = request.failed_waypoint;
  record.cost = request.cost;
  record.foot_violation = request.foot_violation;
  record.com_violation_m = request.com_violation_m;
  record.limit_violation = request.limit_violation;
  record.environment_depth_m = request.environment_depth_m;
  record.self_depth_literal_m = request.self_depth_literal_m;
  record.self_depth_strict_m = request.self_depth_strict_m;
  record.interpolation_environment_depth_m = request.interpolation_environment_depth_m;
  record.interpolation_self_depth_m = request.interpolation_self_depth_m;
  record.interpolation_free_share = request.interpolation_free_share;
  record.windows = request.windows;
  record.windows_solved = request.windows_solved;
  record.history_json = request.history_json;
  record.num_waypoints = std::max(request.num_waypoints, 1);
  record.waypoint_size = request.waypoint_size;
  record.waypoints = request.waypoints;
  return record;
}

}  // namespace

legopt_msg::result_reply Scheduler::Result(const Instant& now, const legopt_msg::result_request& request, Ops& ops) {
  const auto refuse = [&](const std::string& why) {
    ++counters_.results_refused;
    legopt_msg::result_reply reply{};
    reply.status = kRefused;
    reply.message = "job " + std::to_string(request.job_id) + why;
    return reply;
  };
  if (IsDeleted(request.job_id)) return refuse(" was deleted with its experiment");
  const JobRef ref = FindJob(request.job_id);
  const std::optional<db::AttemptRecord> record = AttemptOf(ref, request.job_id, request.attempt);
  if (!record || record->token != request.token) {
    return refuse(" was never leased as attempt " + std::to_string(request.attempt) +
                  " with this token; its experiment was deleted, or the database is another one");
  }
  if (const auto found = workers_.find(record->worker_id); found != workers_.end()) {
    Hear(found->second, now);
  }
  const bool current = ref.experiment != nullptr && request.attempt == ref.experiment->job(ref.index).attempts &&
                       record->job_state == db::JobState::kLeased;
  if (!current) return AnswerEnded(now, *record, request, ops);
  LeaseState& lease = leases_.at(request.job_id);
  // Without a word on it, a job that is given back was not begun.
  const bool given_back = OutcomeOf(request) == db::AttemptOutcome::kCancelled;
  const std::int64_t told_us = request.cpu_us > 0 ? request.cpu_us : request.wall_us;
  if (told_us > 0 || given_back) lease.used_us = told_us;
  if (OutcomeOf(request) == db::AttemptOutcome::kFinished) return AcceptCurrent(now, ref, request, ops);

  db::EndAttempt end;
  end.job_id = request.job_id;
  end.attempt = request.attempt;
  end.outcome = OutcomeOf(request);
  end.exit_signal = request.exit_signal;
  end.message = request.message;
  end.log_tail = request.log_tail;
  // Nobody cancelled this job: the worker gives it back, e.g. because it was told to stop.
  if (end.outcome == db::AttemptOutcome::kCancelled) end.outcome = db::AttemptOutcome::kReturned;
  EndCurrent(now, ref, std::move(end), ops);
  ++counters_.results_accepted;
  return {};
}

// The store may still have what is deleted in the same round: it is not to be asked then.
bool Scheduler::IsDeleted(std::int64_t job_id) const {
  const auto after = deleted_jobs_.upper_bound(job_id);
  return after != deleted_jobs_.begin() && job_id < std::prev(after)->second;
}

// The latest attempt of a job in memory is there; an earlier one, or one of a closed experiment, is in the store: its
// token left this process only after the commit of its lease. Its end may not be committed yet when another lease
// followed in the same round; no second one can, as that lease is not yet known to anybody.
std::optional<db::AttemptRecord> Scheduler::AttemptOf(const JobRef& ref, std::int64_t job_id, int attempt) const {
  if (ref.experiment == nullptr) return lookup_.attempt(job_id, attempt);
  const Job& job = ref.experiment->job(ref.index);
  if (attempt < 1 || attempt > job.attempts) return std::nullopt;
  if (attempt == job.attempts) {
    const auto lease = leases_.find(job_id);
    const std::int64_t worker_id = lease == leases_.end() ? 0 : lease->second.worker_id;
    return db::AttemptRecord{job.token, worker_id, job.outcome, job.state};
  }
  std::optional<db::AttemptRecord> record = lookup_.attempt(job_id, attempt);
  if (record && record->outcome == db::AttemptOutcome::kRunning) record->outcome = job.previous;
  if (record) record->job_state = job.state;
  return record;
}

legopt_msg::result_reply Scheduler::AcceptCurrent(const Instant& now, const JobRef& ref,
                                                  const legopt_msg::result_request& request, Ops& ops) {
  legopt_msg::result_reply reply{};
  const ExperimentSpec& spec = ref.experiment->spec();
  const JobCoordinates at = CoordinatesOf(spec, ref.index);
  db::ResultRecord record = RecordOf(request);
  // Cost and time are per constraint waypoint of the problem, however many rows the solution has.
  record.num_waypoints = spec.tasks[at.task].waypoints[at.problem];
  if (const std::string fault = db::FaultOf(record); !fault.empty()) {
    // Sending it again would not help: end the attempt with the evidence instead of letting its lease run out.
    db::EndAttempt end;
    end.job_id = request.job_id;
    end.attempt = request.attempt;
    end.outcome = db::AttemptOutcome::kError;
    end.message = "the worker sent an illegal result: " + fault;
    end.log_tail = request.log_tail;
    reply.status = kRefused;
    reply.message = end.message;
    ++counters_.results_refused;
    EndCurrent(now, ref, std::move(end), ops);
    return reply;
  }
  Job& job = ref.experiment->job(ref.index);
  job.outcome = db::AttemptOutcome::kFinished;
  job.time_limited = record.solver_status == db::kSolverTimeLimit;
  job.solved = record.verdict_literal == db::kSuccess;
  if (job.solved) ++summaries_.at(ref.experiment->experiment_id()).solved;
  ref.experiment->AddTime(ref.index, record.wall_us);
  DropLease(now, ref);
  SetJobState(*ref.experiment, job, db::JobState::kDone);
  ops.emplace_back(db::AcceptResult{request.job_id, request.attempt, std::move(record), request.message,
                                    request.log_tail, now.wall_us});
  FinishIfComplete(now, *ref.experiment, ops);
  ++counters_.results_accepted;
  reply.status = kAccepted;
  return reply;
}

// Ends the running attempt without a result and decides what becomes of the job.
void Scheduler::EndCurrent(const Instant& now, const JobRef& ref, db::EndAttempt end, Ops& ops) {
  Experiment& experiment = *ref.experiment;
  Job& job = experiment.job(ref.index);
  if (end.outcome == db::AttemptOutcome::kReturned && job.returned >= options_.max_returns_per_job) {
    end.outcome = db::AttemptOutcome::kError;
    end.message += "; given back " + std::to_string(job.returned) + " times before, so it counts";
  }
  if (end.outcome == db::AttemptOutcome::kReturned) {
    ++job.returned;
    ++counters_.attempts_returned;
    end.next = db::JobState::kQueued;
  } else {
    ++counters_.attempts_failed;
    const int charged = job.attempts - job.returned;
    const bool last = charged >= experiment.spec().max_attempts;
    const bool error = end.outcome == db::AttemptOutcome::kError;
    end.next = !last ? db::JobState::kQueued : error ? db::JobState::kFailed : db::JobState::kDead;
  }
  end.at_us = now.wall_us;
  job.outcome = end.outcome;
  DropLease(now, ref);
  SetJobState(experiment, job, end.next);
  if (end.next == db::JobState::kQueued) experiment.PutBack(ref.index);
  std::optional<db::RecordEvent> event;
  if (end.next == db::JobState::kDead || end.next == db::JobState::kFailed) {
    ++(end.next == db::JobState::kDead ? counters_.jobs_dead : counters_.jobs_failed);
    event = db::RecordEvent{end.next == db::JobState::kDead ? "job_dead" : "job_failed",
                            now.wall_us,
                            experiment.experiment_id(),
                            end.job_id,
                            {},
                            std::string(db::ToString(end.outcome)) + ": " + end.message};
  }
  ops.emplace_back(std::move(end));
  if (event) ops.emplace_back(std::move(*event));
  FinishIfComplete(now, experiment, ops);
}

legopt_msg::result_reply Scheduler::AnswerEnded(const Instant& now, const db::AttemptRecord& record,
                                                const legopt_msg::result_request& request, Ops& ops) {
  legopt_msg::result_reply reply{};
  const db::AttemptOutcome reported = OutcomeOf(request);
  if (reported == db::AttemptOutcome::kCancelled) {
    // Withdrawn, returned or expired meanwhile: in each case there is nothing to keep.
    reply.status = record.outcome == db::AttemptOutcome::kCancelled ? kAccepted : kDuplicate;
    return reply;
  }
  if (record.outcome == reported) {
    ++counters_.results_duplicate;
    reply.status = kDuplicate;
    return reply;
  }
  ++counters_.results_stale;
  db::RecordStaleResult stale;
  stale.job_id = request.job_id;
  stale.attempt = request.attempt;
  stale.outcome = reported;
  stale.reason = "attempt " + std::to_string(request.attempt) + " had ended as " +
                 std::string(db::ToString(record.outcome)) + ", job is " + std::string(db::ToString(record.job_state));
  stale.message = request.message;
  stale.at_us = now.wall_us;
  if (reported == db::AttemptOutcome::kFinished) stale.result = RecordOf(request);
  reply.status = kStale;
  reply.message = stale.reason;
  ops.emplace_back(std::move(stale));
  return reply;
}

}  // namespace legopt::server
