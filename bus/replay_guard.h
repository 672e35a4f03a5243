#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <map>
#include <random>
#include <tuple>

#include "bus/key_role.h"
#include "bus/transport.h"

/// @file
/// Which requests are fresh, where a key is configured. Pure; for bus and bridge.
///
/// A session (caller and its session number) is admitted once it has proven that it lives now, by returning this
/// endpoint's challenge under the key; what was recorded before, also before a restart of ours, is refused then. After
/// that a window over its nonces takes each frame once: nonces beyond the highest one, and those of the last
/// kReplayWindow not seen yet. The longest silent session is forgotten first, and the challenge changes with it, so
/// that its old proof is worth nothing. Thread rule: one thread. Source: PROTOCOL.md, section 11.

namespace legopt::bus {

/// Nonces remembered per session. Callers send at most 48 requests at once and one every 25 us after that, so frames
/// that the network delays by less than 100 ms are still inside.
inline constexpr std::int64_t kReplayWindow = 4096;

/// Which nonces of one session have been seen.
class ReplayWindow {
 public:
  /// Refuses everything up to `floor`.
  explicit ReplayWindow(std::int64_t floor) : highest_(floor) { seen_.fill(~std::uint64_t{0}); }
  /// True the first time that a nonce comes, if it is not too old.
  bool Take(std::int64_t nonce);

 private:
  static constexpr std::int64_t kWordBits = 64;
  void Forget(std::int64_t nonce);

  std::int64_t highest_;
  std::array<std::uint64_t, kReplayWindow / kWordBits> seen_{};  // bit nonce % kReplayWindow
};

/// The sessions admitted, each with its window.
class ReplayGuard {
 public:
  /// What a request is.
  enum class Verdict {
    kFresh,     ///< take it
    kReplayed,  ///< seen before, or too old: drop it
    kUnproven   ///< its session has to return challenge() first
  };

  /// Remembers at most `max_sessions`; challenges are drawn from `seed`, which must differ from life to life.
  ReplayGuard(std::size_t max_sessions, std::uint64_t seed);

  /// A request with a good tag arrived, made with the key of `role`. Sessions of different roles never meet.
  Verdict Check(EndpointId caller, std::int64_t session, std::int64_t nonce, KeyRole role = KeyRole::kOperator);
  /// What a session that is not known has to return. Positive, unlike that of any other life.
  std::int64_t challenge() const { return challenge_; }
  /// A proof with a good tag arrived; true when the session is admitted now or was before.
  bool Prove(EndpointId caller, std::int64_t session, std::int64_t nonce, std::int64_t answer,
             KeyRole role = KeyRole::kOperator);

 private:
  using Key = std::tuple<EndpointId, std::int64_t, KeyRole>;
  struct Session {
    ReplayWindow window;
    std::list<Key>::iterator recency;
  };
  void DrawChallenge();

  std::size_t max_sessions_;
  std::mt19937_64 random_;
  std::int64_t challenge_ = 0;
  std::map<Key, Session> sessions_;
  std::list<Key> recency_;  // longest silent first
};

}  // namespace legopt::bus
