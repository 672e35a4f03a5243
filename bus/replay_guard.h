#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <random>
#include <tuple>

#include "bus/message_key.h"
#include "bus/transport.h"

/// @file
/// Detects replayed requests if a key is configured. Pure; used by bus and bridge.
///
/// A session (caller and its session number) is admitted after it has returned this endpoint's challenge under the key,
/// which proves that it is live. Recorded requests are therefore rejected, even those from before a restart of this
/// endpoint. After that, a sliding window over the session's nonces accepts each frame once: nonces above the highest
/// one, and unseen ones among the last kReplayWindow. If there are too many sessions, the one silent for the longest
/// time is dropped, and the challenge is replaced to invalidate its old proof. Thread rule: one thread. Source:
/// PROTOCOL.md, section 11.

namespace legopt::bus {

/// Number of nonces remembered per session. Callers send bursts of at most 48 requests and then one every 25 us, so
/// frames delayed by less than 100 ms are within the window.
inline constexpr std::int64_t kReplayWindow = 4096;

/// Sliding window of the nonces seen in one session.
class ReplayWindow {
 public:
  /// Treats all nonces up to `floor` as seen.
  explicit ReplayWindow(std::int64_t floor) : highest_(floor) { seen_.fill(~std::uint64_t{0}); }
  /// Accepts a nonce once. Returns false if it was seen before or is too old.
  bool Take(std::int64_t nonce);

 private:
  static constexpr std::int64_t kWordBits = 64;
  void ClearNonce(std::int64_t nonce);

  std::int64_t highest_;
  std::array<std::uint64_t, kReplayWindow / kWordBits> seen_{};  // bit nonce % kReplayWindow
};

/// Admitted sessions with their windows.
class ReplayGuard {
 public:
  /// Result of checking a request.
  enum class Verdict {
    kFresh,     ///< accept it
    kReplayed,  ///< seen before, or too old: drop it
    kUnproven   ///< the session must first return challenge()
  };

  /// Remembers at most `max_sessions`. Challenges are random numbers from `seed`, which must differ after each restart.
  ReplayGuard(std::size_t max_sessions, std::uint64_t seed);

  /// Checks a request with a valid tag, made with the key of `role`. Sessions of different roles are separate.
  Verdict Check(EndpointId caller, std::int64_t session, std::int64_t nonce, KeyRole role = KeyRole::kOperator);
  /// Number that an unknown session must return. Positive, and different after each restart.
  std::int64_t challenge() const { return challenge_; }
  /// Processes a proof with a valid tag. Returns whether the session is now admitted.
  bool Prove(EndpointId caller, std::int64_t session, std::int64_t nonce, std::int64_t answer,
             KeyRole role = KeyRole::kOperator);

 private:
  using Key = std::tuple<EndpointId, std::int64_t, KeyRole>;
  struct Session {
    ReplayWindow window;
    std::list<Key>::iterator recency;
  };
  void GenerateChallenge();

  std::size_t max_sessions_;
  std::mt19937_64 random_;
  std::int64_t challenge_ = 0;
  std::map<Key, Session> sessions_;
  std::list<Key> recency_;  // longest silent first
};

}  // namespace legopt::bus
