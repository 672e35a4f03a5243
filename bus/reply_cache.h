#pragma once

#include <compare>
#include <cstdint>
#include <list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "bus/transport.h"

/// @file
/// Duplicate suppression and cached replies for the calls served by this endpoint. Pure; private to bus.
///
/// Stores, for each caller (address and session), which calls are open, answered or finished. Every request contains
/// the number below which all calls of its caller are finished (completed_below); their replies are dropped. Memory is
/// bounded: above the limit the oldest replies are dropped first, and a repeat of such a call is answered with
/// kReplyGone. Thread rule: one thread. Source: PROTOCOL.md, section 5.

namespace legopt::bus {

/// Identifies a call at the serving party.
struct CallKey {
  EndpointId caller = 0;     ///< address of the caller
  std::int64_t session = 0;  ///< session of the caller's endpoint, new after each restart
  std::int64_t call_id = 0;  ///< number within the session
  /// Role of the caller's key. Calls of different roles are separate, even with equal addresses and sessions.
  KeyRole role = KeyRole::kOperator;
};

/// Calls that this endpoint serves.
class ReplyCache {
 public:
  /// Memory limits.
  struct Limits {
    std::size_t max_cached_bytes;   ///< bytes of answered calls; the newest reply is always kept
    std::size_t max_open_requests;  ///< unanswered requests of all callers
    std::size_t max_peers;          ///< callers (address and session) remembered
  };
  /// Encoded body, shared with the sender of large bodies and immutable.
  using Body = std::shared_ptr<const std::string>;

  /// State of the call of an incoming request.
  enum class Verdict {
    kNew,               ///< opened now: pass it to its handler
    kOpen,              ///< a handler is processing it
    kAnswered,          ///< see Lookup::reply
    kFinishedByCaller,  ///< the caller reported it as finished
    kEvicted,           ///< answered, but the reply has been dropped
    kBusy,              ///< refused: too many open requests
  };
  /// Stored answer.
  struct Reply {
    std::int16_t type = 0;   ///< MessageType of the call
    std::int16_t error = 0;  ///< 0: body is the reply; otherwise an ErrorCode, and body is its text
    Body body;               ///< encoded message, or the text of a refusal
  };
  /// State of a call.
  struct Lookup {
    Verdict verdict = Verdict::kNew;
    Reply reply;  ///< set for kAnswered
  };

  /// `counters` must outlive this object.
  ReplyCache(Counters& counters, const Limits& limits) : counters_(counters), limits_(limits) {}

  /// Looks up the call of a request and opens it if it is new.
  Lookup Open(const CallKey& key, std::int16_t type, std::int64_t completed_below);
  /// Looks up a call without opening it.
  Lookup Find(const CallKey& key) const;
  /// Stores the reply of an open request and returns it; returns nothing if the request is not open (any more).
  std::optional<Reply> Answer(const CallKey& key, std::int16_t error, Body body);

  std::size_t held_bytes() const { return held_bytes_; }  ///< cached replies, including the overhead of their entries

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
    std::list<CallKey>::iterator age;  // position in answered_, if answered
  };
  struct Peer {
    std::int64_t completed_below = 1;
    std::int64_t evicted_below = 1;
    std::map<std::int64_t, Entry> calls;
    std::list<PeerKey>::iterator recency;  // position in recency_
  };
  using Peers = std::unordered_map<PeerKey, Peer, PeerKeyHash>;

  Peers::iterator Touch(const PeerKey& key);
  void EvictReply(std::map<std::int64_t, Entry>& calls, std::map<std::int64_t, Entry>::iterator call);
  void EvictPeer(Peers::iterator peer);
  void Evict();
  static Lookup Describe(const Peer& peer, std::int64_t call_id);

  Counters& counters_;
  Limits limits_;
  Peers peers_;
  std::list<PeerKey> recency_;   // silent for the longest time first
  std::list<CallKey> answered_;  // oldest first
  std::size_t held_bytes_ = 0;
  std::size_t num_open_ = 0;
};

}  // namespace legopt::bus
