// Part of Pool for slots, job processes and results.

#include <algorithm>
#include <array>
#include <csignal>
#include <utility>

#include "app/exit_codes.h"
#include "app/processes.h"
#include "legopt/types/reply.h"
#include "worker/job_executor.h"
#include "worker/pool.h"

namespace legopt::worker {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr microseconds kFirstDeliveryRetry = milliseconds(250);
constexpr microseconds kLastDeliveryRetry = seconds(5);
constexpr std::size_t kMaxDeliveriesInFlight = 64;
constexpr int kMaxFailedStarts = 3;  // failed starts per slot, before any process was ever ready
constexpr double kMicroseconds = 1e6;

std::string JobName(const LeaseKey& key) {
  return "job " + std::to_string(key.job_id) + " (attempt " + std::to_string(key.attempt) + ")";
}

std::string SecondsText(microseconds duration) {
  std::string text = std::to_string(static_cast<double>(duration.count()) / kMicroseconds);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text + " s";
}

// Describes the end of a process that had a job and was not killed by the worker.
legopt_msg::result_request DescribeExit(const ChildExit& exit) {
  if (exit.signal == 0 && exit.exit_code == kChildOutOfMemory) {
    return ResultWithoutSolution(ReportedOutcome::kMemoryLimit, "the job needed more memory than its limit allows");
  }
  if (exit.signal == 0 && exit.exit_code == kChildNotStarted) {
    return ResultWithoutSolution(ReportedOutcome::kCrashed, "the job process could not be started: " + exit.log_tail);
  }
  const std::string how = exit.signal != 0 ? "was ended by " + app::SignalMeaning(exit.signal)
                                           : "exited with code " + std::to_string(exit.exit_code) + " without a result";
  return ResultWithoutSolution(ReportedOutcome::kCrashed, "the job process " + how);
}

std::vector<Capability> DatasetsAmong(const std::vector<Capability>& capabilities) {
  std::vector<Capability> datasets;
  for (const Capability& capability : capabilities) {
    if (capability.kind == CapabilityKind::kDataset) datasets.push_back(capability);
  }
  return datasets;
}

}  // namespace

// --- Job processes ---------------------------------------------------------------------------------------------------

void Pool::ApplyCommand(int slot, JobSlot::Command command) {
  switch (command) {
    case JobSlot::Command::kStart:
      actions_.emplace_back(StartChild{slot});
      break;
    case JobSlot::Command::kCancel:
      actions_.emplace_back(CancelJob{slot});
      break;
    case JobSlot::Command::kKill:
      actions_.emplace_back(KillChild{slot});
      break;
    case JobSlot::Command::kNone:
      break;
  }
}

void Pool::AdvanceSlots(microseconds now) {
  for (int i = 0; i < options_.slots; ++i) ApplyCommand(i, slots_[static_cast<std::size_t>(i)].machine.Tick(now));
}

void Pool::OnChildReady(microseconds now, int slot, const std::vector<Capability>& capabilities) {
  JobSlot& machine = slots_[static_cast<std::size_t>(slot)].machine;
  const bool first = capabilities_.empty();
  const std::vector<Capability> datasets = DatasetsAmong(capabilities);
  if (datasets.empty()) {
    OnChildGarbage(now, slot, "ready without a dataset");
    return;
  }
  // Only changed datasets end the worker. Jobs of a changed solver are refused, because the announced one no longer
  // exists.
  if (!first && datasets != DatasetsAmong(capabilities_)) {
    Log(LogLevel::kError,
        "the files of a dataset have changed since this worker started; start the worker again to use the new ones");
    ApplyCommand(slot, machine.Kill(StopReason::kGarbage, "loaded other datasets than the processes before it"));
    Drain(now, ExitCode::kDatasetMismatch);
  } else if (!machine.Ready()) {
    OnChildGarbage(now, slot, "ready at the wrong time");
    return;
  } else if (first) {
    capabilities_ = capabilities;
    last_heard_ = now;  // the search for a server starts here
    registration_.reset();
    hello_backoff_ = microseconds(0);
    next_hello_ = now;
    for (const Capability& capability : capabilities) {
      if (capability.hash.empty()) continue;
      Log(LogLevel::kInfo, std::string(ToString(capability.kind)) + " " + capability.name + " " + capability.hash);
    }
  }
  Advance(now);
}

void Pool::OnChildStartFailed(microseconds now, int slot, const std::string& message) {
  Log(LogLevel::kError, message);
  if (capabilities_.empty()) {
    Finish(ExitCode::kUsage);
    return;
  }
  ApplyCommand(slot, slots_[static_cast<std::size_t>(slot)].machine.Kill(StopReason::kGarbage, message));
  Advance(now);
}

void Pool::OnChildProgress(microseconds now, int slot, std::uint64_t sequence, int done, int total) {
  const SlotEntry& entry = slots_[static_cast<std::size_t>(slot)];
  if (!entry.machine.IsCurrent(sequence) || total < 0 || done < 0 || done > total) {
    OnChildGarbage(now, slot, "progress of no job");
    return;
  }
  if (const auto it = leases_.find(entry.key); it != leases_.end()) {
    it->second.progress_done = done;
    it->second.progress_total = total;
  }
}

void Pool::OnChildJudging(microseconds now, int slot, std::uint64_t sequence) {
  if (!slots_[static_cast<std::size_t>(slot)].machine.Judging(now, sequence)) {
    OnChildGarbage(now, slot, "judging without a job");
  }
}

void Pool::OnChildResult(microseconds now, int slot, std::uint64_t sequence, legopt_msg::result_request result) {
  SlotEntry& entry = slots_[static_cast<std::size_t>(slot)];
  const StopReason reason = entry.machine.stop_reason();
  if (!entry.machine.Finish(sequence)) {
    OnChildGarbage(now, slot, "a result of no job");
    return;
  }
  const bool refused = ReportedOutcome{result.outcome} == ReportedOutcome::kRefused;
  if (refused && reason == StopReason::kNone) {
    RefuseLease(now, entry.key, result.message);
  } else if (reason == StopReason::kNone || reason == StopReason::kTimeLimit) {
    RecordJobDuration(now - entry.machine.assigned_at());
    KeepResult(now, entry.key, std::move(result));
  } else {
    EndStoppedJob(now, entry.key, reason);
  }
  Advance(now);
}

void Pool::OnChildGarbage(microseconds now, int slot, const std::string& why) {
  JobSlot& machine = slots_[static_cast<std::size_t>(slot)].machine;
  const JobSlot::Command command = machine.Kill(StopReason::kGarbage, why);
  if (command != JobSlot::Command::kNone) {
    Log(LogLevel::kWarning,
        "slot " + std::to_string(slot) + ": job process broke the protocol (" + why + "), killing it");
  }
  ApplyCommand(slot, command);
  Advance(now);
}

void Pool::OnChildExited(microseconds now, int slot, const ChildExit& exit) {
  SlotEntry& entry = slots_[static_cast<std::size_t>(slot)];
  JobSlot& machine = entry.machine;
  const bool starting = machine.state() == JobSlot::State::kStarting;
  if (machine.has_job()) {
    EndKilledJob(now, entry, exit);
  } else if (starting || machine.state() == JobSlot::State::kIdle) {
    Log(LogLevel::kWarning, "slot " + std::to_string(slot) + ": " + DescribeExit(exit).message +
                                (starting ? " while it loaded its datasets" : " between two jobs"));
  }
  machine.Exited(now);
  CheckStarts(exit);
  Advance(now);
}

void Pool::CheckStarts(const ChildExit& last) {
  const auto hopeless = [](const SlotEntry& slot) { return slot.machine.failed_starts() >= kMaxFailedStarts; };
  if (!capabilities_.empty() || !std::all_of(slots_.begin(), slots_.end(), hopeless)) return;
  const std::string cause = last.signal != 0 ? "; the last one was ended by " + app::SignalMeaning(last.signal) : "";
  Log(LogLevel::kError, "job processes cannot be started" + cause +
                            (last.log_tail.empty() ? "" : "; the last one wrote: " + last.log_tail));
  const bool machine = last.exit_code == kChildNotStarted || last.exit_code == kChildOutOfMemory;
  Finish(machine ? ExitCode::kMachine : ExitCode::kInternal);
}

void Pool::RecordJobDuration(microseconds duration) {
  const auto us = static_cast<double>(duration.count());
  mean_job_us_ = mean_job_us_ < 0 ? us : mean_job_us_ + kAverageWeight * (us - mean_job_us_);
}

// --- Jobs ------------------------------------------------------------------------------------------------------------

void Pool::Dispatch(microseconds now) {
  for (int i = 0; i < options_.slots && !ready_.empty(); ++i) {
    SlotEntry& slot = slots_[static_cast<std::size_t>(i)];
    if (slot.machine.state() != JobSlot::State::kIdle) continue;
    const auto runnable = [this](const LeaseKey& key) {
      const auto method = methods_.find(leases_.at(key).lease.method_hash);
      return method != methods_.end() && method->second.options_json != nullptr;
    };
    const auto next = std::find_if(ready_.begin(), ready_.end(), runnable);
    if (next == ready_.end()) return;
    slot.key = *next;
    ready_.erase(next);
    HeldLease& held = leases_.at(slot.key);
    held.phase = Phase::kRunning;
    const std::uint64_t sequence = slot.machine.Assign(now, microseconds(held.lease.wall_limit_us));
    actions_.emplace_back(AssignJob{i, sequence, held.lease, methods_.at(held.lease.method_hash).options_json});
  }
}

void Pool::StopLease(microseconds now, const LeaseKey& key, StopReason reason) {
  if (std::erase(ready_, key) > 0) {
    EndStoppedJob(now, key, reason);
    return;
  }
  for (int i = 0; i < options_.slots; ++i) {
    SlotEntry& slot = slots_[static_cast<std::size_t>(i)];
    if (slot.machine.has_job() && slot.key == key) ApplyCommand(i, slot.machine.StopJob(now, reason));
  }
}

// Outcome "cancelled" of a job that was not cancelled releases it: the server re-queues it without using an attempt.
void Pool::EndStoppedJob(microseconds now, const LeaseKey& key, StopReason reason) {
  switch (reason) {
    case StopReason::kCancelled:
      return KeepResult(now, key, ResultWithoutSolution(ReportedOutcome::kCancelled, "cancelled"));
    case StopReason::kLeaseExpiring:
      return KeepResult(
          now, key, ResultWithoutSolution(ReportedOutcome::kCancelled, "released: the lease was not renewed in time"));
    case StopReason::kShutdown:
      return KeepResult(now, key, ResultWithoutSolution(ReportedOutcome::kCancelled, "released: the worker stops"));
    case StopReason::kWaited:
      return KeepResult(now, key,
                        ResultWithoutSolution(ReportedOutcome::kCancelled, "released: no slot was free for it"));
    case StopReason::kNone:
    case StopReason::kTimeLimit:
    case StopReason::kUnknownLease:
    case StopReason::kGarbage:
      leases_.erase(key);  // the server does not expect a result
  }
}

void Pool::ReleaseReady(microseconds now) {
  const std::deque<LeaseKey> waiting = ready_;
  for (const LeaseKey& key : waiting) StopLease(now, key, StopReason::kShutdown);
}

// Returns when the first ready lease has waited too long; empty unless it waits for running jobs. A lease that waits
// for its method or for the first job process would not start earlier on another worker.
std::optional<microseconds> Pool::WaitEnd() const {
  const auto busy = [](const SlotEntry& slot) { return slot.machine.has_job(); };
  const auto idle = [](const SlotEntry& slot) { return slot.machine.state() == JobSlot::State::kIdle; };
  if (ready_.empty() || std::any_of(slots_.begin(), slots_.end(), idle) ||
      std::none_of(slots_.begin(), slots_.end(), busy)) {
    return std::nullopt;
  }
  return leases_.at(ready_.front()).accepted + options_.max_prefetch_wait;
}

void Pool::ReleaseWaiting(microseconds now) {
  for (auto end = WaitEnd(); end && *end <= now; end = WaitEnd()) {
    const LeaseKey key = ready_.front();
    StopLease(now, key, StopReason::kWaited);
  }
}

// Returns whether the end of a process was caused by terminating the worker from outside. A batch system or container
// may kill the job processes slightly before the worker; that is not the fault of their jobs.
bool Pool::WasStoppedExternally(const JobSlot& machine, const ChildExit& exit) const {
  constexpr std::array kFromOutside = {SIGTERM, SIGINT, SIGHUP, SIGKILL};
  return stop_requested_ && machine.stop_reason() == StopReason::kNone &&
         std::find(kFromOutside.begin(), kFromOutside.end(), exit.signal) != kFromOutside.end();
}

void Pool::EndKilledJob(microseconds now, const SlotEntry& slot, const ChildExit& exit) {
  const JobSlot& machine = slot.machine;
  if (WasStoppedExternally(machine, exit)) {
    Log(LogLevel::kWarning, JobName(slot.key) + ": its process was ended by " + app::SignalMeaning(exit.signal) +
                                " while this worker stops; released");
    return EndStoppedJob(now, slot.key, StopReason::kShutdown);
  }
  legopt_msg::result_request result;
  switch (machine.stop_reason()) {
    case StopReason::kNone:
      result = DescribeExit(exit);
      break;
    case StopReason::kTimeLimit: {
      const microseconds limit(leases_.at(slot.key).lease.wall_limit_us);
      result =
          ResultWithoutSolution(ReportedOutcome::kTimeLimit,
                                "killed: still running " + SecondsText(options_.slot_times.kill_grace) +
                                    " after the wall-time limit of " + SecondsText(limit) + ", or endless judging");
      break;
    }
    case StopReason::kGarbage:
      result = ResultWithoutSolution(ReportedOutcome::kCrashed,
                                     "the job process broke the protocol: " + machine.stop_detail());
      break;
    case StopReason::kCancelled:
    case StopReason::kUnknownLease:
    case StopReason::kLeaseExpiring:
    case StopReason::kShutdown:
    case StopReason::kWaited:
      EndStoppedJob(now, slot.key, machine.stop_reason());
      return;
  }
  result.exit_signal = exit.signal;
  result.log_tail = PrintableTail(exit.log_tail, kMaxLogTailBytes);
  result.peak_memory_bytes = exit.peak_memory_bytes;
  result.wall_us = (now - machine.assigned_at()).count();
  Log(LogLevel::kWarning, JobName(slot.key) + ": " + result.message);
  KeepResult(now, slot.key, std::move(result));
}

void Pool::FailLease(microseconds now, const LeaseKey& key, const std::string& message) {
  std::erase(ready_, key);
  Log(LogLevel::kWarning, JobName(key) + ": " + message);
  KeepResult(now, key, ResultWithoutSolution(ReportedOutcome::kError, message));
}

void Pool::RefuseLease(microseconds now, const LeaseKey& key, const std::string& message) {
  std::erase(ready_, key);
  Log(LogLevel::kWarning, JobName(key) + ": refused: " + message);
  KeepResult(now, key, ResultWithoutSolution(ReportedOutcome::kRefused, message));
}

// --- Results ---------------------------------------------------------------------------------------------------------

void Pool::KeepResult(microseconds now, const LeaseKey& key, legopt_msg::result_request result) {
  const auto it = leases_.find(key);
  if (it == leases_.end()) return;
  result.job_id = key.job_id;
  result.attempt = key.attempt;
  result.token = key.token;
  HeldLease& held = it->second;
  held.phase = Phase::kDelivering;
  held.result = std::make_shared<const legopt_msg::result_request>(std::move(result));
  held.next_delivery = now;
}

std::size_t Pool::NumIn(Phase phase) const {
  return static_cast<std::size_t>(std::count_if(leases_.begin(), leases_.end(),
                                                [phase](const auto& entry) { return entry.second.phase == phase; }));
}

std::size_t Pool::num_running() const { return NumIn(Phase::kRunning); }

std::size_t Pool::num_undelivered() const { return NumIn(Phase::kDelivering); }

bool Pool::CanDeliver() const {
  // The worker must be registered, because results contain its id.
  return registration_ && deliveries_in_flight_ < kMaxDeliveriesInFlight;
}

void Pool::DeliverResults(microseconds now) {
  for (auto& [key, held] : leases_) {
    if (!CanDeliver()) return;
    if (held.phase != Phase::kDelivering || held.in_flight || now < held.next_delivery) continue;
    if (held.result->worker_id != registration_->worker_id) {
      legopt_msg::result_request named = *held.result;
      named.worker_id = registration_->worker_id;
      held.result = std::make_shared<const legopt_msg::result_request>(std::move(named));
    }
    held.in_flight = true;
    ++deliveries_in_flight_;
    actions_.emplace_back(CallResult{key, held.result});
  }
}

void Pool::OnResultReply(microseconds now, const LeaseKey& key, const legopt_msg::result_reply* reply,
                         const std::string& error) {
  --deliveries_in_flight_;
  const auto it = leases_.find(key);
  if (it != leases_.end()) {
    HeldLease& held = it->second;
    held.in_flight = false;
    if (reply == nullptr) {
      held.delivery_backoff = std::clamp(held.delivery_backoff * 2, kFirstDeliveryRetry, kLastDeliveryRetry);
      held.next_delivery = now + held.delivery_backoff;
      ServerSilent(now, error);
    } else {
      HeardServer(now);
      const ResultStatus status{reply->status};
      const std::string text = PrintableText(reply->message, kMaxMessageBytes);
      if (status == ResultStatus::kStale) Log(LogLevel::kInfo, JobName(key) + ": result came too late: " + text);
      if (status == ResultStatus::kRefused)
        Log(LogLevel::kError, JobName(key) + ": the server refuses the result: " + text);
      leases_.erase(it);
    }
  }
  Advance(now);
}

}  // namespace legopt::worker
