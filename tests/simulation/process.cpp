#include "tests/simulation/process.h"

#include <algorithm>

namespace legopt::simulation {
namespace {

constexpr microseconds kStartAgain{300'000};  // after a failed start

}  // namespace

void Process::Work() {
  if (paused()) return;
  if (!up_) {
    life_ = Life{};
    transport_.Poll({}, microseconds(0));  // drops datagrams that arrived while no process was running
    up_ = Start();
    start_at_ = world_.now() + kStartAgain;
    if (up_) ++lives_;
    return;
  }
  try {
    Turn();
  } catch (const ProcessDied&) {
  }
  if (!life_.alive()) Die();
}

microseconds Process::due() const {
  if (!up_) return std::max(start_at_, paused_until_);
  const microseconds next = std::min(next_turn(), transport_.station().next_arrival().value_or(microseconds::max()));
  return std::max(next, paused_until_);
}

void Process::Kill(microseconds outage) {
  outage_ = outage;
  life_.Kill();
  if (up_) Die();
}

void Process::KillAfter(std::uint64_t points, microseconds outage) {
  outage_ = outage;
  life_.KillAfter(points);
}

void Process::Pause(microseconds time) {
  paused_until_ = std::max(paused_until_, time);
  if (up_) OnPause();
}

void Process::Die() {
  up_ = false;
  start_at_ = world_.now() + outage_;
  paused_until_ = std::min(paused_until_, world_.now());
  DestroyObjects();
}

}  // namespace legopt::simulation
