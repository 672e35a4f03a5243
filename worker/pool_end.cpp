// Part of Pool that ends the worker.

#include <algorithm>
#include <utility>

#include "app/exit_codes.h"
#include "worker/job_executor.h"
#include "worker/pool.h"

namespace legopt::worker {
namespace {

constexpr microseconds kLeaseAnswer = std::chrono::seconds(1);  // time that a leaving worker waits for a lease reply
constexpr microseconds kStopLimit = std::chrono::milliseconds(9'500);     // less than docker's 10 s
constexpr microseconds kLastDelivery = std::chrono::milliseconds(1'500);  // time to release jobs after the drain

}  // namespace

void Pool::Stop(microseconds now) {
  if (killing_) {
    Finish(ExitCode::kInterrupted);
  } else if (stop_requested_) {
    killing_ = true;
    if (!leases_.empty()) exit_code_ = ExitCode::kInterrupted;
    delivering_since_ = now;
    ReleaseRunning();
  } else {
    stop_requested_ = true;
    Drain(now, ExitCode::kOk);
    drain_end_ = now + options_.drain;
    stop_end_ = std::max(now + kStopLimit, drain_end_ + kLastDelivery);
    if (const std::size_t running = num_running(); running > 0) {
      Log(LogLevel::kWarning, "stopping: " + std::to_string(running) + " running job(s) may finish within " +
                                  Seconds(options_.drain) +
                                  ", then they are released; a second signal releases them at once");
    }
  }
  Advance(now);
}

// Called after 'legopt service drain' at the server. There is no time limit: running jobs end normally.
void Pool::DrainForServer(microseconds now) {
  if (draining_) return;
  Log(LogLevel::kWarning,
      "asked to leave by 'legopt service drain': " + std::to_string(num_running()) + " running job(s) may finish");
  Drain(now, ExitCode::kOk);
}

void Pool::Drain(microseconds now, ExitCode exit_code) {
  if (draining_) return;
  draining_ = true;
  exit_code_ = exit_code;
  delivering_since_ = now;
  for (SlotEntry& slot : slots_) slot.machine.Retire();
  ReleaseReady(now);
}

void Pool::EndDrain(microseconds now) {
  if (!draining_ || jobs_released_ || now < drain_end_) return;
  if (const std::size_t running = num_running(); running > 0) {
    Log(LogLevel::kWarning, std::to_string(running) + " job(s) still running after " + Seconds(options_.drain) +
                                ": released without using an attempt");
    delivering_since_ = now;
  }
  ReleaseRunning();
}

void Pool::ReleaseRunning() {
  jobs_released_ = true;
  for (int i = 0; i < options_.slots; ++i) {
    ApplyCommand(i, slots_[static_cast<std::size_t>(i)].machine.Kill(StopReason::kShutdown, ""));
  }
}

// The server would also refuse all further calls.
void Pool::OnKeyRefused(microseconds now, const std::string& error) {
  Log(LogLevel::kError,
      "the server refuses this worker: " + PrintableText(error, kMaxMessageBytes) +
          (options_.key_file.empty() ? "" : " (this worker has the key in " + options_.key_file + ")"));
  Finish(ExitCode::kNotPermitted);
  Advance(now);
}

// Does not wait for an answer. If the message is lost, the server considers the worker lost after the duration of a
// lease.
void Pool::SendLeavingHeartbeat() {
  if (!registration_) return;
  legopt_msg::heartbeat_request request{};
  request.load = options_.load();
  request.worker_id = registration_->worker_id;
  request.server_instance = registration_->server_instance;
  request.leaving = 1;
  actions_.emplace_back(CallHeartbeat{std::move(request)});
}

void Pool::Finish(ExitCode exit_code) {
  if (finished_) return;
  finished_ = true;
  SendLeavingHeartbeat();
  actions_.emplace_back(ExitWorker{exit_code});
}

microseconds Pool::DeliveryEnd() const {
  return std::min(stop_end_, delivering_since_ + (killing_ ? options_.kill_limit : options_.delivery_limit));
}

// A leaving worker waits for a lease reply in flight and releases its jobs; otherwise their leases would expire and
// cost an attempt.
microseconds Pool::LeaseAnswerEnd() const {
  return lease_in_flight_ && !killing_ ? lease_asked_at_ + kLeaseAnswer : microseconds(0);
}

microseconds Pool::IdleEnd() const {
  const bool counts = idle_since_ && !draining_ && options_.idle_timeout != microseconds::max();
  return counts ? *idle_since_ + options_.idle_timeout : microseconds::max();
}

// Records since when there has been no job. Results being delivered do not count as jobs, because without a server
// delivery may never end. Returns true if the time is too long.
bool Pool::CheckIdle(microseconds now) {
  if (capabilities_.empty() || num_undelivered() != leases_.size()) {
    idle_since_.reset();
  } else if (!idle_since_) {
    idle_since_ = now;
  }
  return now >= IdleEnd();
}

void Pool::CheckDrained(microseconds now) {
  const bool only_deliveries = num_undelivered() == leases_.size();
  if (leases_.empty() && now >= LeaseAnswerEnd()) {
    Finish(exit_code_);
  } else if (!only_deliveries && !jobs_released_) {
    delivering_since_ = now;
  } else if (now >= DeliveryEnd()) {
    Log(LogLevel::kError, std::to_string(leases_.size()) + " result(s) could not be delivered");
    Finish(killing_ ? ExitCode::kInterrupted : ExitCode::kUnreachable);
  }
}

void Pool::CheckEnd(microseconds now) {
  if (finished_) return;
  if (CheckIdle(now)) {
    Log(LogLevel::kWarning, "no job for " + Seconds(options_.idle_timeout) + ": leaving");
    Drain(now, ExitCode::kOk);
  }
  if (draining_) return CheckDrained(now);
  if (!wanted_dataset_.empty() && leases_.empty() && !lease_in_flight_) {
    Log(LogLevel::kInfo, "jobs wait for dataset " + wanted_dataset_ + ", which the server hands out");
    ended_to_fetch_ = wanted_dataset_;
    finished_ = true;  // no goodbye, because the worker continues
    actions_.emplace_back(ExitWorker{ExitCode::kOk});
    return;
  }
  if (options_.exit_when_idle && no_more_work_ && leases_.empty()) {
    Log(LogLevel::kInfo, "no more work");
    Finish(ExitCode::kOk);
    return;
  }
  if (options_.wait_server != microseconds::max() && !capabilities_.empty() &&
      now >= last_heard_ + options_.wait_server) {
    const std::string key = options_.key_file.empty() ? "" : ", and with the key in " + options_.key_file;
    const std::string place = options_.bridged ? "with --listen on one of these addresses" : "with this port and group";
    Log(LogLevel::kError, "no answer from a server at " + options_.server_address + " within " +
                              Seconds(options_.wait_server) + "; is legopt-server running " + place + key + "?");
    Finish(ExitCode::kUnreachable);
  }
}

}  // namespace legopt::worker
