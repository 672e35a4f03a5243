#include "bus/replay_guard.h"

namespace legopt::bus {

bool ReplayWindow::Take(std::int64_t nonce) {
  // This order prevents overflow of the difference, because highest_ is never negative.
  if (nonce < 1 || highest_ - nonce >= kReplayWindow) return false;
  if (nonce > highest_) {
    if (nonce - highest_ >= kReplayWindow) {
      seen_.fill(0);
    } else {
      for (std::int64_t passed = highest_ + 1; passed <= nonce; ++passed) ClearNonce(passed);
    }
    highest_ = nonce;
  }
  const std::int64_t bit = nonce % kReplayWindow;
  std::uint64_t& word = seen_[static_cast<std::size_t>(bit / kWordBits)];
  const std::uint64_t mask = std::uint64_t{1} << static_cast<unsigned>(bit % kWordBits);
  if ((word & mask) != 0) return false;
  word |= mask;
  return true;
}

void ReplayWindow::ClearNonce(std::int64_t nonce) {
  const std::int64_t bit = nonce % kReplayWindow;
  seen_[static_cast<std::size_t>(bit / kWordBits)] &= ~(std::uint64_t{1} << static_cast<unsigned>(bit % kWordBits));
}

ReplayGuard::ReplayGuard(std::size_t max_sessions, std::uint64_t seed) : max_sessions_(max_sessions), random_(seed) {
  GenerateChallenge();
}

void ReplayGuard::GenerateChallenge() { challenge_ = static_cast<std::int64_t>(random_() >> 1U) | 1; }

ReplayGuard::Verdict ReplayGuard::Check(EndpointId caller, std::int64_t session, std::int64_t nonce, KeyRole role) {
  const auto found = sessions_.find({caller, session, role});
  if (found == sessions_.end()) return Verdict::kUnproven;
  if (!found->second.window.Take(nonce)) return Verdict::kReplayed;
  recency_.splice(recency_.end(), recency_, found->second.recency);
  return Verdict::kFresh;
}

bool ReplayGuard::Prove(EndpointId caller, std::int64_t session, std::int64_t nonce, std::int64_t answer,
                        KeyRole role) {
  const Key key{caller, session, role};
  if (sessions_.contains(key)) return true;  // repeated proof; the window must not move
  if (answer != challenge_ || nonce < 1) return false;
  while (sessions_.size() >= max_sessions_ && !recency_.empty()) {
    sessions_.erase(recency_.front());
    recency_.pop_front();
    GenerateChallenge();
  }
  // Requests sent before the proof may have been handled before a restart of this endpoint.
  const auto recency = recency_.insert(recency_.end(), key);
  sessions_.emplace(key, Session{ReplayWindow(nonce), recency});
  return true;
}

}  // namespace legopt::bus
