#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bulk_sender.h"
#include "bus/counters.h"
#include "bus/wire.h"

/// @file
/// Puts large bodies together from chunks and says what to acknowledge. Pure; private to bus. Source: PROTOCOL.md,
/// section 6.
///
/// Memory is bounded by the declared sizes of incomplete bodies; a body that does not fit is not begun, so that its
/// sender tries again later. Thread rule: one thread.

namespace legopt::bus {

/// All incomplete bodies that others send to this endpoint.
class BulkReceiver {
 public:
  /// Bounds of what is held.
  struct Limits {
    std::size_t max_incoming_bytes;  ///< declared sizes of incomplete bodies together
    microseconds lifetime;           ///< of an incomplete body without a new chunk
  };
  /// What a chunk led to; both empty: nothing is to be done.
  struct Outcome {
    std::optional<std::string> body;  ///< complete and verified
    std::optional<ChunkAck> ack;      ///< to be sent, unless `body` is set (then the caller decides)
  };

  /// `first_reassembly`: any number that other lives of this party are unlikely to use.
  BulkReceiver(Counters& counters, const Limits& limits, std::int64_t first_reassembly)
      : counters_(counters), limits_(limits), next_reassembly_(first_reassembly) {}

  /// Takes a chunk; begins a body with the first of it that comes. Counts chunks that contradict what is known.
  Outcome Accept(const ObjectKey& key, const ChunkView& chunk, microseconds now);
  /// What acknowledges a body that is complete.
  ChunkAck CompleteAck(bool of_reply) const;
  /// Forgets an incomplete body, e.g. of a call that is over.
  void Drop(const ObjectKey& key);
  /// Forgets what has been silent for `lifetime`.
  void OnTimer(microseconds now);
  std::optional<microseconds> next_timer() const;         ///< when OnTimer has something to do; empty: never
  std::size_t held_bytes() const { return held_bytes_; }  ///< declared sizes of incomplete bodies together

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
