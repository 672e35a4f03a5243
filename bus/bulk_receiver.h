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
/// Reassembles large bodies from chunks and generates acknowledgements. Pure; private to bus. Source: PROTOCOL.md,
/// section 6.
///
/// The declared sizes of incomplete bodies bound the memory. A body that does not fit is ignored, so that its sender
/// tries again later. Thread rule: one thread.

namespace legopt::bus {

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
