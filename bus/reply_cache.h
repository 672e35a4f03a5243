#pragma once

#include <compare>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "bus/counters.h"
#include "bus/key_role.h"
#include "bus/transport.h"

/// @file
/// Duplicate suppression and replies of the calls that others make to us. Pure; private to bus.
///
/// Per caller (address and session) it knows which calls are open, answered or over. A caller tells with every request
/// below which number all its calls are finished (completed_below); their replies are forgotten then. Memory is
/// bounded: when the replies exceed the limit the oldest go first, and a repeat of such a call is answered "reply
/// gone". Thread rule: one thread. Source: PROTOCOL.md, section 5.

namespace legopt::bus {

/// One call, as the served party knows it.
struct CallKey {
  EndpointId caller = 0;     ///< address
  std::int64_t session = 0;  ///< of the caller's endpoint, in this life
  std::int64_t call_id = 0;  ///< within the session
  /// Role of the caller's key. Calls of different roles never meet, whatever address and session they claim.
  KeyRole role = KeyRole::kOperator;
};

/// The calls that others make to this endpoint.
class ReplyCache {
 public:
  /// Bounds of what is held.
  struct Limits {
    std::size_t max_cached_bytes;   ///< of answered calls; the newest reply stays whatever its size
    std::size_t max_open_requests;  ///< not answered yet, of all callers
    std::size_t max_peers;          ///< callers (address and session) remembered
  };
  /// Shared with the sender of large bodies; must not change.
  using Body = std::shared_ptr<const std::string>;

  /// What a request turned out to be.
  enum class Verdict {
    kNew,       ///< opened now: hand it to its handler
    kOpen,      ///< being handled
    kAnswered,  ///< see reply
    kOver,      ///< the caller itself called it finished
    kGone,      ///< answered long ago, reply forgotten
    kBusy,      ///< too many open requests
  };
  /// An answer as it was given.
  struct Reply {
    std::int16_t type = 0;   ///< MessageType of the call
    std::int16_t error = 0;  ///< 0: body is the reply; else an ErrorCode and body its text
    Body body;               ///< encoded message, or the text of a refusal
  };
  /// What is known of a call.
  struct Lookup {
    Verdict verdict = Verdict::kNew;  ///< how it stands
    Reply reply;                      ///< kAnswered
  };

  /// `counters` must outlive this.
  ReplyCache(Counters& counters, const Limits& limits) : counters_(counters), limits_(limits) {}

  /// A request arrived. Opens it when it is new.
  Lookup Open(const CallKey& key, std::int16_t type, std::int64_t completed_below);
  /// How a call stands, without opening it.
  Lookup Find(const CallKey& key) const;
  /// Stores the reply of an open request and returns it; empty when it is not open (any more).
  std::optional<Reply> Answer(const CallKey& key, std::int16_t error, Body body);

  std::size_t held_bytes() const { return held_bytes_; }  ///< of cached replies, with what their entries cost

 private:
  struct PeerKey {
    EndpointId caller;
    std::int64_t session;
    KeyRole role;
    bool operator==(const PeerKey&) const = default;
  };
  struct PeerKeyHash {
    std::size_t operator()(const PeerKey& key) const;
  };
  struct Entry {
    bool answered = false;
    Reply reply;
    std::list<CallKey>::iterator age;  // in answered_, when answered
  };
  struct Peer {
    std::int64_t completed_below = 1;
    std::int64_t evicted_below = 1;
    std::map<std::int64_t, Entry> calls;
    std::list<PeerKey>::iterator recency;  // in recency_
  };
  using Peers = std::unordered_map<PeerKey, Peer, PeerKeyHash>;

  Peers::iterator Touch(const PeerKey& key);
  void Forget(std::map<std::int64_t, Entry>& calls, std::map<std::int64_t, Entry>::iterator call);
  void ForgetPeer(Peers::iterator peer);
  void Evict();
  static Lookup Describe(const Peer& peer, std::int64_t call_id);

  Counters& counters_;
  Limits limits_;
  Peers peers_;
  std::list<PeerKey> recency_;   // longest silent first
  std::list<CallKey> answered_;  // oldest first
  std::size_t held_bytes_ = 0;
  std::size_t num_open_ = 0;
};

}  // namespace legopt::bus
