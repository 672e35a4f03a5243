#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bus/counters.h"
#include "bus/transport.h"
#include "bus/wire.h"

/// @file
/// Sends large bodies as chunks: window, selective acknowledgement, loss detection, pacing. Pure: time and
/// acknowledgements go in, chunks come out through `emit`. Private to bus. Source: PROTOCOL.md, section 6.
///
/// Thread rule: one thread.

namespace legopt::bus {

/// One body under way: of which call, in which direction, to or from which peer.
struct ObjectKey {
  EndpointId peer = 0;       ///< to whom or from whom
  std::int64_t session = 0;  ///< of the caller
  std::int64_t call_id = 0;  ///< within the session
  bool of_reply = false;     ///< else of the request
  /// Role of the caller's key.
  KeyRole role = KeyRole::kOperator;
  auto operator<=>(const ObjectKey&) const = default;
};

/// All bodies that this endpoint sends.
class BulkSender {
 public:
  /// Shared with whoever may need it again; must not change.
  using Body = std::shared_ptr<const std::string>;
  /// Sends one chunk, at once.
  using Emit = std::function<void(const ObjectKey&, std::int16_t type, const ChunkView&)>;
  /// `delivered` is false when the receiver showed no progress for kPatience.
  using Done = std::function<void(const ObjectKey&, bool delivered)>;

  /// `emit` and `done` are called from within the other functions; `counters` must outlive this.
  BulkSender(Counters& counters, Emit emit, Done done);

  /// Starts, or starts again, to send `body` (not empty).
  void Start(const ObjectKey& key, std::int16_t type, Body body, microseconds now);
  /// Sends the first chunk once more, unacknowledged, to hear how the receiver stands.
  void Remind(const ObjectKey& key, std::int16_t type, const Body& body);
  /// Stops sending, without a word to `done`.
  void Cancel(const ObjectKey& key, microseconds now);
  /// False when nothing is being sent under `key`.
  bool OnAck(const ObjectKey& key, const ChunkAck& ack, microseconds now);
  /// Sends again what is lost, and gives up what has shown no progress for kPatience.
  void OnTimer(microseconds now);
  std::optional<microseconds> next_timer() const;  ///< when OnTimer has something to do; empty: never
  bool Sending(const ObjectKey& key) const { return objects_.contains(key); }  ///< whether a body is under way
  std::size_t held_bytes() const { return held_bytes_; }                       ///< of all bodies under way

 private:
  struct Flight {
    std::int32_t index;
    std::int64_t order;  // number of this transmission towards the peer
    microseconds sent;
    bool resent;
  };
  struct Object {
    std::int16_t type = 0;
    Body body;
    ObjectHash hash{};
    std::int64_t reassembly = 0;       // of the receiver, as it said last; 0 = not heard yet
    std::int64_t past_reassembly = 0;  // the one before, whose late acknowledgements mean nothing
    std::vector<bool> acked;
    std::int32_t first_unacked = 0;
    std::int32_t next_new = 0;
    std::vector<Flight> flights;
    std::set<std::int32_t> lost;  // to be sent again, lowest first
    std::int64_t highest_acked_order = 0;
    int back_off = 0;  // time-outs in a row
    microseconds last_progress{0};
    microseconds timer{0};
  };
  // What all bodies to one peer share.
  struct Peer {
    std::size_t credit;
    std::size_t in_flight = 0;
    std::int64_t order = 0;
    microseconds smoothed_rtt{0};  // 0 = not measured yet
    microseconds rtt_deviation{0};
    std::deque<ObjectKey> waiting;  // whose turn it is to fill the window
  };
  using Objects = std::map<ObjectKey, Object>;

  using PeerKey = std::pair<EndpointId, KeyRole>;
  static PeerKey PeerOf(const ObjectKey& key) { return {key.peer, key.role}; }
  void Fill(const PeerKey& peer, microseconds now);
  bool EmitNext(const ObjectKey& key, Object& object, Peer& peer, microseconds now);
  static bool HasMore(const Object& object);
  void Acknowledge(Object& object, Peer& peer, std::int32_t index, microseconds now);
  static void StartAfresh(Object& object, Peer& peer);
  void MeasureRtt(Peer& peer, microseconds sample);
  void DetectLoss(Object& object, Peer& peer, microseconds now);
  microseconds RetransmitTimeout(const Object& object, const Peer& peer) const;
  void Rearm(const ObjectKey& key, Object& object, const Peer& peer);
  void Remove(Objects::iterator object);
  ChunkView MakeChunk(const Object& object, std::int32_t index, bool ack_requested) const;

  Counters& counters_;
  Emit emit_;
  Done done_;
  Objects objects_;
  std::map<PeerKey, Peer> peers_;
  std::set<std::pair<microseconds, ObjectKey>> timers_;
  std::size_t held_bytes_ = 0;
};

}  // namespace legopt::bus
