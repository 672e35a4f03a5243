#include <algorithm>
#include <array>
#include <csignal>
#include <map>
#include <utility>
#include <vector>

#include "legopt/types/reply.h"
#include "server/result_message.h"
#include "server/scheduler.h"

namespace legopt::server {
namespace {

// Returns true for signals that a process causes itself. KILL, TERM and similar signals come from other processes.
bool IsOwnFault(int signal) {
  constexpr std::array<int, 7> kSignals = {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGSYS, SIGTRAP};
  return std::ranges::find(kSignals, signal) != kSignals.end();
}

// Returns true if the job crashed with the same signal twice in a row. Jobs are deterministic, so another attempt would
// crash again.
bool CrashesAgain(Job& job, const db::EndAttempt& end) {
  const bool fault = end.outcome == db::AttemptOutcome::kCrashed && IsOwnFault(end.exit_signal);
  const bool again = fault && job.fault_signal == end.exit_signal;
  job.fault_signal = static_cast<std::uint8_t>(fault ? end.exit_signal : 0);
  return again;
}

const std::string kIllegalResult = "the worker sent an illegal result: ";

}  // namespace

legopt_msg::result_reply Scheduler::Result(const Instant& now, const legopt_msg::result_request& request, Ops& ops) {
  const auto refuse = [&](const std::string& why) {
    ++counters_.results_refused;
    legopt_msg::result_reply reply{};
    reply.status = EnumNumber(ResultStatus::kRefused);
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
  // A released job without reported times was not started.
  const db::AttemptOutcome reported = OutcomeOf(request);
  const bool given_back = reported == db::AttemptOutcome::kCancelled || reported == db::AttemptOutcome::kReturned;
  const std::int64_t reported_us = request.cpu_us > 0 ? request.cpu_us : request.wall_us;
  if (reported_us > 0 || given_back) lease.used_us = reported_us;
  if (reported == db::AttemptOutcome::kFinished) return AcceptCurrent(now, ref, request, ops);

  db::EndAttempt end;
  end.job_id = request.job_id;
  end.attempt = request.attempt;
  end.outcome = OutcomeOf(request);
  end.exit_signal = request.exit_signal;
  end.message = request.message;
  end.log_tail = request.log_tail;
  // The job was not cancelled: the worker releases it, e.g. because it was asked to stop.
  if (end.outcome == db::AttemptOutcome::kCancelled) end.outcome = db::AttemptOutcome::kReturned;
  const bool refused = ReportedOutcome{request.outcome} == ReportedOutcome::kRefused;
  if (refused) {
    end.message = "refused: " + end.message;
    NoteRefusal(now, ref, request.message, ops);
  }
  EndCurrent(now, ref, std::move(end), ops, refused ? Charge::kNever : Charge::kByOutcome);
  ++counters_.results_accepted;
  return {};
}

// The store may still contain jobs that are deleted in the same round; it must not be queried for them.
bool Scheduler::IsDeleted(std::int64_t job_id) const {
  const auto after = deleted_jobs_.upper_bound(job_id);
  return after != deleted_jobs_.begin() && job_id < std::prev(after)->second;
}

// The latest attempt of a job in memory is known. Earlier attempts, and those of closed experiments, are in the store,
// because a token is sent only after the commit of its lease. The end of the previous attempt may be uncommitted if
// another lease followed in the same round; this cannot be true for more than one attempt, because the token of that
// lease has not been sent yet.
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
  auto [record, fault] = ResultOf(request);
  // Cost and time are per constraint waypoint of the problem, independent of the number of rows of the solution.
  record.num_waypoints = spec.tasks[at.task].waypoints[at.problem];
  if (fault.empty()) fault = db::FaultOf(record);
  if (!fault.empty()) {
    // Sending it again would not help: end the attempt and store the error instead of letting its lease expire.
    db::EndAttempt end;
    end.job_id = request.job_id;
    end.attempt = request.attempt;
    end.outcome = db::AttemptOutcome::kError;
    end.message = kIllegalResult + fault;
    end.log_tail = request.log_tail;
    reply.status = EnumNumber(ResultStatus::kRefused);
    reply.message = end.message;
    ++counters_.results_refused;
    EndCurrent(now, ref, std::move(end), ops);
    return reply;
  }
  Job& job = ref.experiment->job(ref.index);
  job.outcome = db::AttemptOutcome::kFinished;
  job.time_limited = record.solver_status == SolveStatus::kTimeLimit;
  db::ExperimentSummary& summary = summaries_.at(ref.experiment->experiment_id());
  job.solved = record.SolvedBy(summary.rule);
  if (job.solved) ++summary.solved;
  ref.experiment->AddTime(ref.index, record.wall_us);
  DropLease(now, ref);
  SetJobState(*ref.experiment, ref.index, db::JobState::kDone);
  ops.emplace_back(db::AcceptResult{request.job_id, request.attempt, std::move(record), request.message,
                                    request.log_tail, now.wall_us});
  FinishIfComplete(now, *ref.experiment, ops);
  ++counters_.results_accepted;
  reply.status = EnumNumber(ResultStatus::kAccepted);
  return reply;
}

// Ends the running attempt without a result and determines the new state of the job.
void Scheduler::EndCurrent(const Instant& now, const JobRef& ref, db::EndAttempt end, Ops& ops, Charge charge) {
  Experiment& experiment = *ref.experiment;
  Job& job = experiment.job(ref.index);
  const bool free = charge == Charge::kNever || job.returned < options_.max_returns_per_job;
  if (end.outcome == db::AttemptOutcome::kReturned && !free) {
    end.outcome = db::AttemptOutcome::kError;
    end.message += "; released " + std::to_string(job.returned) + " times before, so it counts as an attempt";
  }
  if (end.outcome == db::AttemptOutcome::kReturned) {
    ++job.returned;
    ++counters_.attempts_returned;
    end.next = db::JobState::kQueued;
  } else {
    ++counters_.attempts_failed;
    const int charged = job.attempts - job.returned;
    const bool repeated = CrashesAgain(job, end);
    const bool limit = end.outcome == db::AttemptOutcome::kTimeLimit;  // another attempt would hit the same limit
    const bool last = charged >= experiment.spec().max_attempts || repeated || limit;
    if (repeated && charged < experiment.spec().max_attempts) {
      end.message += "; not tried again: the attempt before ended by the same signal";
    }
    const bool error = end.outcome == db::AttemptOutcome::kError;
    end.next = !last ? db::JobState::kQueued : error ? db::JobState::kFailed : db::JobState::kDead;
  }
  end.at_us = now.wall_us;
  job.outcome = end.outcome;
  DropLease(now, ref);
  SetJobState(experiment, ref.index, end.next);
  if (end.next == db::JobState::kQueued) experiment.PutBack(ref.index);
  std::optional<db::RecordEvent> event;
  if (end.next == db::JobState::kDead || end.next == db::JobState::kFailed) {
    ++(end.next == db::JobState::kDead ? counters_.jobs_dead : counters_.jobs_failed);
    event = db::RecordEvent{end.next == db::JobState::kDead ? "job_dead" : "job_failed",
                            now.wall_us,
                            experiment.experiment_id(),
                            end.job_id,
                            {},
                            std::string(ToString(end.outcome)) + ": " + end.message};
  }
  ops.emplace_back(std::move(end));
  if (event) ops.emplace_back(std::move(*event));
  FinishIfComplete(now, experiment, ops);
}

legopt_msg::result_reply Scheduler::AnswerEnded(const Instant& now, const db::AttemptRecord& record,
                                                const legopt_msg::result_request& request, Ops& ops) {
  legopt_msg::result_reply reply{};
  const db::AttemptOutcome reported = OutcomeOf(request);
  if (reported == db::AttemptOutcome::kCancelled || reported == db::AttemptOutcome::kReturned) {
    // Cancelled, released or expired in the meantime: in each case there is nothing to store.
    reply.status = record.outcome == db::AttemptOutcome::kCancelled ? EnumNumber(ResultStatus::kAccepted)
                                                                    : EnumNumber(ResultStatus::kDuplicate);
    return reply;
  }
  if (record.outcome == reported) {
    ++counters_.results_duplicate;
    reply.status = EnumNumber(ResultStatus::kDuplicate);
    return reply;
  }
  db::RecordStaleResult stale;
  if (reported == db::AttemptOutcome::kFinished) {
    auto [result, fault] = ResultOf(request);
    if (!fault.empty()) {  // the result is discarded: there is no column for unknown enum names
      ++counters_.results_refused;
      reply.status = EnumNumber(ResultStatus::kRefused);
      reply.message = kIllegalResult + fault;
      return reply;
    }
    stale.result = std::move(result);
  }
  ++counters_.results_stale;
  stale.job_id = request.job_id;
  stale.attempt = request.attempt;
  stale.outcome = reported;
  stale.reason = "attempt " + std::to_string(request.attempt) + " had ended as " +
                 std::string(ToString(record.outcome)) + ", job is " + std::string(ToString(record.job_state));
  stale.message = request.message;
  stale.at_us = now.wall_us;
  reply.status = EnumNumber(ResultStatus::kStale);
  reply.message = stale.reason;
  ops.emplace_back(std::move(stale));
  return reply;
}

// Reuse of finished results of identical jobs.

// Jobs with known results become done; the others wait for their leases. Returns the number of the former. The state is
// consistent whether or not the request is answered.
std::int64_t Scheduler::ReuseKnownResults(const Instant& now, Experiment& experiment,
                                          const std::vector<std::int64_t>& jobs, const Worker& worker, Ops& ops) {
  std::map<std::size_t, std::vector<std::int64_t>> of_cell;  // a search is of one cell
  for (const std::int64_t index : jobs) of_cell[experiment.KindOf(index)].push_back(index);
  std::map<std::int64_t, db::KnownResult> known;
  for (const auto& [cell, indices] : of_cell) {
    const std::vector<db::KnownResult> found = KnownResultsOf(experiment, indices, worker);
    for (std::size_t i = 0; i < found.size(); ++i) known.emplace(indices[i], found[i]);
  }
  experiment.SetSearched(jobs);
  std::int64_t reused = 0;
  for (const auto& [index, result] : known) {
    const Job& job = experiment.job(index);
    const bool fresh = job.state == db::JobState::kQueued && job.attempts == 0;
    // Results deleted in the same round are still in the store.
    if (!fresh || result.job_id == 0 || IsDeleted(result.job_id)) continue;
    Bind(now, experiment, worker, ops);
    ReuseStoredResult(now, experiment, index, result, ops);
    ++reused;
  }
  FinishIfComplete(now, experiment, ops);
  return reused;
}

// Returns one element per job of one cell; empty if the experiment is restricted to one build and that build is
// unknown. Jobs are described by the inputs that determine their results, because rows of this experiment may not be
// committed yet.
std::vector<db::KnownResult> Scheduler::KnownResultsOf(const Experiment& experiment,
                                                       const std::vector<std::int64_t>& jobs,
                                                       const Worker& worker) const {
  const ExperimentSpec& spec = experiment.spec();
  const db::ExperimentControl& control = summaries_.at(experiment.experiment_id()).control;
  const JobCoordinates cell = CoordinatesOf(spec, jobs.front());
  const ExperimentSpec::TaskProblems& task = spec.tasks[cell.task];
  db::ResultSearch search;
  if (control.builds == BuildPolicy::kOne) {
    search.build_id = control.build_id.empty() ? worker.record.build_id : control.build_id;
    if (search.build_id->empty()) return {};
  }
  search.experiment_id = experiment.experiment_id();
  search.dataset_hash = spec.dataset.hash;
  search.method_hash = spec.methods[cell.method].hash;
  search.task = task.task;
  search.initialization = spec.initializations[cell.initialization];
  search.seed = spec.seed;
  search.effort_limit = task.effort_limit;
  search.wall_limit_us = task.wall_limit_us;
  search.memory_limit_bytes = spec.memory_limit_bytes;
  search.rule = summaries_.at(experiment.experiment_id()).rule;
  for (const std::int64_t index : jobs) {
    const JobCoordinates at = CoordinatesOf(spec, index);
    search.problems.push_back({task.problems[at.problem], static_cast<int>(at.repetition)});
  }
  return lookup_.known_results(search);
}

void Scheduler::ReuseStoredResult(const Instant& now, Experiment& experiment, std::int64_t index,
                                  const db::KnownResult& known, Ops& ops) {
  db::ExperimentSummary& summary = summaries_.at(experiment.experiment_id());
  Job& job = experiment.job(index);
  job.attempts = 1;
  job.token = tokens_();
  job.outcome = db::AttemptOutcome::kFinished;
  job.solved = known.solved;
  summary.solved += known.solved ? 1 : 0;
  ++summary.taken_over;
  ++counters_.results_taken_over;
  experiment.AddTime(index, known.wall_us);
  SetJobState(experiment, index, db::JobState::kDone);
  ops.emplace_back(db::ReuseResult{experiment.job_id(index), known.job_id, job.token, now.wall_us});
}

}  // namespace legopt::server
