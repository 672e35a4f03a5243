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

#include "bus/endpoint.h"
#include "bus/transport.h"
#include "bus/wire.h"

namespace legopt::bus {

/// @file
/// Sends large bodies as chunks: window, selective acknowledgement, loss detection, pacing. Pure: time and
/// acknowledgements are inputs, chunks are outputs through `emit`. Private to bus. Source: PROTOCOL.md, section 6.
///
/// Thread rule: one thread.

/// Identifies a body being sent or received: the peer, the call and the direction.
struct ObjectKey {
  EndpointId peer = 0;       ///< sender or receiver of the body
  std::int64_t session = 0;  ///< session of the caller
  std::int64_t call_id = 0;  ///< number within the session
  bool of_reply = false;     ///< true: body of the reply; false: body of the request
  /// Role of the caller's key.
  KeyRole role = KeyRole::kOperator;
  auto operator<=>(const ObjectKey&) const = default;
};

/// All bodies that this endpoint is sending.
class BulkSender {
 public:
  /// Encoded body, shared and immutable.
  using Body = std::shared_ptr<const std::string>;
  /// Sends one chunk immediately.
  using Emit = std::function<void(const ObjectKey&, std::int16_t type, const ChunkView&)>;
  /// Called at the end of a transfer. `delivered` is false if the receiver made no progress for kPatience.
  using Done = std::function<void(const ObjectKey&, bool delivered)>;

  /// `emit` and `done` are called from within the other functions. `counters` must outlive this object.
  BulkSender(Counters& counters, Emit emit, Done done);

  /// Starts or restarts sending `body` (not empty).
  void Start(const ObjectKey& key, std::int16_t type, Body body, microseconds now);
  /// Repeats the first chunk, so that the receiver reports its state. Does not wait for an acknowledgement.
  void RequestAck(const ObjectKey& key, std::int16_t type, const Body& body);
  /// Stops sending without calling `done`.
  void Cancel(const ObjectKey& key, microseconds now);
  /// Processes an acknowledgement. Returns false if no body is being sent under `key`.
  bool OnAck(const ObjectKey& key, const ChunkAck& ack, microseconds now);
  /// Re-sends lost chunks. Gives up bodies without progress for kPatience.
  void OnTimer(microseconds now);
  std::optional<microseconds> next_timer() const;  ///< next time for OnTimer; empty: never
  /// Returns whether the body of `key` is being sent.
  bool Sending(const ObjectKey& key) const { return objects_.contains(key); }
  std::size_t held_bytes() const { return held_bytes_; }  ///< total size of all bodies being sent

 private:
  struct Flight {
    std::int32_t index;
    std::int64_t order;  // transmission number towards the peer
    microseconds sent;
    bool resent;
  };
  struct Object {
    std::int16_t type = 0;
    Body body;
    ObjectHash hash{};
    std::int64_t reassembly = 0;       // last number reported by the receiver; 0: none yet
    std::int64_t past_reassembly = 0;  // previous number; late acknowledgements with it are ignored
    std::vector<bool> acked;
    std::int32_t first_unacked = 0;
    std::int32_t next_new = 0;
    std::vector<Flight> flights;
    std::set<std::int32_t> lost;  // chunks to re-send, lowest first
    std::int64_t highest_acked_order = 0;
    int back_off = 0;  // consecutive time-outs
    microseconds last_progress{0};
    microseconds timer{0};
  };
  // State shared by all bodies to one peer.
  struct Peer {
    std::size_t credit;
    std::size_t in_flight = 0;
    std::int64_t order = 0;
    microseconds smoothed_rtt{0};  // 0: not measured yet
    microseconds rtt_deviation{0};
    std::deque<ObjectKey> waiting;  // bodies that take turns to fill the window
  };
  using Objects = std::map<ObjectKey, Object>;

  using PeerKey = std::pair<EndpointId, KeyRole>;
  static PeerKey PeerOf(const ObjectKey& key) { return {key.peer, key.role}; }
  void Fill(const PeerKey& peer, microseconds now);
  bool EmitNext(const ObjectKey& key, Object& object, Peer& peer, microseconds now);
  static bool HasMore(const Object& object);
  void Acknowledge(Object& object, Peer& peer, std::int32_t index, microseconds now);
  static void RestartTransfer(Object& object, Peer& peer);
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

// Reassembles large bodies from chunks and generates acknowledgements. Pure; private to bus. Source: PROTOCOL.md,
// section 6.
//
// The declared sizes of incomplete bodies bound the memory. A body that does not fit is ignored, so that its sender
// tries again later. Thread rule: one thread.

/// All incomplete bodies being sent to this endpoint.
class BulkReceiver {
 public:
  /// Memory and time limits.
  struct Limits {
    std::size_t max_incoming_bytes;  ///< total of the declared sizes of incomplete bodies
    microseconds lifetime;           ///< maximum time without a new chunk, after which an incomplete body is dropped
  };
  /// Result of a chunk; both empty: nothing to do.
  struct Outcome {
    std::optional<std::string> body;  ///< complete and verified
    std::optional<ChunkAck> ack;      ///< acknowledgement to send, unless `body` is set; then the caller decides
  };

  /// `first_reassembly` should differ from the numbers used before a restart of this party.
  BulkReceiver(Counters& counters, const Limits& limits, std::int64_t first_reassembly)
      : counters_(counters), limits_(limits), next_reassembly_(first_reassembly) {}

  /// Stores a chunk. The first chunk received of a body starts its reassembly. Counts contradictory chunks as rejected.
  Outcome Accept(const ObjectKey& key, const ChunkView& chunk, microseconds now);
  /// Returns the acknowledgement of a complete body.
  ChunkAck CompleteAck(bool of_reply) const;
  /// Drops an incomplete body, e.g. of a finished call.
  void Drop(const ObjectKey& key);
  /// Drops bodies that have received no new chunk for `lifetime`.
  void OnTimer(microseconds now);
  std::optional<microseconds> next_timer() const;         ///< next time for OnTimer; empty: never
  std::size_t held_bytes() const { return held_bytes_; }  ///< total of the declared sizes of incomplete bodies

 private:
  struct Object {
    std::int64_t reassembly = 0;
    std::size_t total_bytes = 0;
    ObjectHash hash{};
    std::unique_ptr<std::uint8_t[]> bytes;
    std::vector<bool> received;
    std::size_t missing = 0;
    std::size_t received_below = 0;
    microseconds last_chunk{0};
  };
  using Objects = std::map<ObjectKey, Object>;

  Objects::iterator Begin(const ObjectKey& key, const ChunkView& chunk);
  void Remove(Objects::iterator object);
  ChunkAck MakeAck(const ObjectKey& key, const Object& object) const;
  std::int32_t Credit() const;

  Counters& counters_;
  Limits limits_;
  std::int64_t next_reassembly_;
  Objects objects_;
  std::size_t held_bytes_ = 0;
};

}  // namespace legopt::bus
