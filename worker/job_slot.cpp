#include "worker/job_slot.h"

#include <algorithm>
#include <utility>

namespace legopt::worker {
namespace {

constexpr microseconds kNever = microseconds::max();

}  // namespace

void JobSlot::SetState(State state, microseconds deadline) {
  state_ = state;
  deadline_ = deadline;
}

JobSlot::Command JobSlot::Tick(microseconds now) {
  if (now < deadline_) return Command::kNone;
  switch (state_) {
    case State::kDown:
      if (retired_) {
        deadline_ = kNever;
        return Command::kNone;
      }
      SetState(State::kStarting, now + times_.start_limit);
      return Command::kStart;
    case State::kStarting:
      return Kill(StopReason::kGarbage, "did not load its datasets in time");
    case State::kRunning:
      return Kill(StopReason::kTimeLimit, "");
    case State::kCancelling:
      return Kill(reason_, "");
    case State::kIdle:
    case State::kStopping:
      break;
  }
  deadline_ = kNever;
  return Command::kNone;
}

bool JobSlot::Ready() {
  if (state_ == State::kStopping) return true;  // sent before the kill
  if (state_ != State::kStarting) return false;
  failed_starts_ = 0;
  SetState(State::kIdle, kNever);
  return true;
}

std::uint64_t JobSlot::Assign(microseconds now, microseconds wall_limit) {
  sequence_ = ++last_sequence_;
  assigned_at_ = now;
  reason_ = StopReason::kNone;
  detail_.clear();
  SetState(State::kRunning, now + wall_limit + times_.kill_grace);
  return sequence_;
}

bool JobSlot::Judging(microseconds now, std::uint64_t sequence) {
  if (!IsCurrent(sequence)) return false;
  if (state_ == State::kRunning) deadline_ = now + times_.judge_limit;
  return true;
}

bool JobSlot::Finish(std::uint64_t sequence) {
  if (!IsCurrent(sequence)) return false;
  sequence_ = 0;
  if (state_ != State::kStopping) SetState(State::kIdle, kNever);
  return true;
}

JobSlot::Command JobSlot::StopJob(microseconds now, StopReason reason) {
  if (state_ != State::kRunning) return Command::kNone;
  reason_ = reason;
  SetState(State::kCancelling, now + times_.cancel_grace);
  return Command::kCancel;
}

JobSlot::Command JobSlot::Kill(StopReason reason, std::string detail) {
  if (state_ == State::kDown || state_ == State::kStopping) return Command::kNone;
  if (state_ == State::kStarting) ++failed_starts_;
  reason_ = reason;
  detail_ = std::move(detail);
  SetState(State::kStopping, kNever);
  return Command::kKill;
}

void JobSlot::Exited(microseconds now) {
  if (state_ == State::kStarting) ++failed_starts_;
  sequence_ = 0;
  reason_ = StopReason::kNone;
  detail_.clear();
  microseconds wait{0};
  if (failed_starts_ > 0) {
    constexpr int kMaxDoublings = 16;
    wait = std::min(times_.last_restart, times_.first_restart * (1 << std::min(failed_starts_ - 1, kMaxDoublings)));
  }
  SetState(State::kDown, now + wait);
}

}  // namespace legopt::worker
