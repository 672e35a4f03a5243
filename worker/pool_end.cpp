// The part of Pool that ends it.

#include <utility>

#include "worker/exit_codes.h"
#include "worker/pool.h"

namespace legopt::worker {
namespace {

constexpr microseconds kLeaseAnswer = std::chrono::seconds(1);  // waited for by a worker that leaves

}  // namespace

void Pool::Stop(microseconds now) {
  if (killing_) {
    Finish(kExitInterrupted);
  } else if (draining_) {
    killing_ = true;
    if (!leases_.empty()) exit_code_ = kExitInterrupted;
    drain_since_ = now;
    for (int i = 0; i < options_.slots; ++i) {
      Carry(i, slots_[static_cast<std::size_t>(i)].machine.Kill(StopReason::kShutdown, ""));
    }
  } else {
    Drain(now, kExitOk);
    if (!leases_.empty()) {
      Log(LogLevel::kWarning,
          "stopping after " + std::to_string(num_running()) + " running job(s); a second signal kills them");
    }
  }
  Advance(now);
}

void Pool::Drain(microseconds now, int exit_code) {
  if (draining_) return;
  draining_ = true;
  exit_code_ = exit_code;
  drain_since_ = now;
  for (SlotEntry& slot : slots_) slot.machine.Retire();
  GiveBackReady(now);
}

void Pool::Finish(int exit_code) {
  if (finished_) return;
  finished_ = true;
  actions_.emplace_back(ExitWorker{exit_code});
}

microseconds Pool::DrainEnd() const { return drain_since_ + (killing_ ? options_.kill_limit : options_.drain_limit); }

// A worker that leaves hears what it has been leased meanwhile, and gives it back: its lease would run out at a cost.
microseconds Pool::LeaseAnswerEnd() const {
  return lease_in_flight_ && !killing_ ? lease_asked_at_ + kLeaseAnswer : microseconds(0);
}

void Pool::CheckEnd(microseconds now) {
  if (finished_) return;
  if (draining_) {
    const bool only_deliveries = num_undelivered() == leases_.size();
    if (leases_.empty() && now >= LeaseAnswerEnd()) {
      Finish(exit_code_);
    } else if (!only_deliveries && !killing_) {
      drain_since_ = now;
    } else if (now >= DrainEnd()) {
      Log(LogLevel::kError, std::to_string(leases_.size()) + " result(s) could not be delivered");
      Finish(killing_ ? kExitInterrupted : kExitUnreachable);
    }
    return;
  }
  if (options_.exit_when_idle && no_more_work_ && leases_.empty()) {
    Log(LogLevel::kInfo, "no more work");
    Finish(kExitOk);
    return;
  }
  if (options_.wait_server != microseconds::max() && !datasets_.empty() && now >= last_heard_ + options_.wait_server) {
    Log(LogLevel::kError, "no answer from a server at " + options_.server_address + " within " +
                              Seconds(options_.wait_server) + "; is legopt-server running with this port and group?");
    Finish(kExitUnreachable);
  }
}

}  // namespace legopt::worker
