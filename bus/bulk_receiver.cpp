#include "bus/bulk_receiver.h"

#include <algorithm>
#include <cstring>

namespace legopt::bus {
namespace {

// Maximum number of datagrams in flight to one receiver, over all senders. Larger bursts must be expected to lose
// datagrams (docs/explanation/reliability.md#what-lcm-and-udp-do).
constexpr std::size_t kBurst = 60;
constexpr std::size_t kMinCredit = 2;

}  // namespace

std::int32_t BulkReceiver::Credit() const {
  const std::size_t share = kBurst / std::max<std::size_t>(objects_.size(), 1);
  return static_cast<std::int32_t>(std::clamp(share, kMinCredit, kWindow));
}

BulkReceiver::Objects::iterator BulkReceiver::Begin(const ObjectKey& key, const ChunkView& chunk) {
  const auto total_bytes = static_cast<std::size_t>(chunk.total_bytes);
  if (held_bytes_ + total_bytes > limits_.max_incoming_bytes) return objects_.end();
  Object object;
  object.reassembly = next_reassembly_++;
  object.total_bytes = total_bytes;
  object.hash = chunk.hash;
  // Deliberately uninitialised, so that a sender that declares a large size but sends nothing uses no memory pages.
  object.bytes.reset(new std::uint8_t[total_bytes]);
  object.missing = NumChunks(total_bytes);
  object.received.resize(object.missing);
  held_bytes_ += total_bytes;
  return objects_.emplace(key, std::move(object)).first;
}

void BulkReceiver::Remove(Objects::iterator object) {
  held_bytes_ -= object->second.total_bytes;
  objects_.erase(object);
}

void BulkReceiver::Drop(const ObjectKey& key) {
  const auto object = objects_.find(key);
  if (object != objects_.end()) Remove(object);
}

BulkReceiver::Outcome BulkReceiver::Accept(const ObjectKey& key, const ChunkView& chunk, microseconds now) {
  auto found = objects_.find(key);
  if (found == objects_.end()) found = Begin(key, chunk);
  if (found == objects_.end()) return {};
  Object& object = found->second;
  if (object.total_bytes != static_cast<std::size_t>(chunk.total_bytes) || object.hash != chunk.hash) {
    ++counters_.rejected_object;
    return {};
  }
  const auto index = static_cast<std::size_t>(chunk.index);
  if (object.received[index]) {
    ++counters_.duplicate_chunks;
    return {std::nullopt, MakeAck(key, object)};
  }
  std::memcpy(object.bytes.get() + index * kChunkBytes, chunk.data.data(), chunk.data.size());
  object.received[index] = true;
  object.last_chunk = now;
  while (object.received_below < object.received.size() && object.received[object.received_below]) {
    ++object.received_below;
  }
  if (--object.missing > 0) {
    if (!chunk.ack_requested) return {};
    return {std::nullopt, MakeAck(key, object)};
  }
  Outcome outcome;
  const std::span<const std::uint8_t> bytes(object.bytes.get(), object.total_bytes);
  if (HashObject(bytes) == object.hash) {
    outcome.body.emplace(bytes.begin(), bytes.end());
    ++counters_.objects_received;
  } else {
    ++counters_.rejected_object;  // the sender starts again
  }
  Remove(found);
  return outcome;
}

ChunkAck BulkReceiver::MakeAck(const ObjectKey& key, const Object& object) const {
  ChunkAck ack;
  ack.of_reply = key.of_reply;
  ack.reassembly = object.reassembly;
  ack.received_below = static_cast<std::int32_t>(object.received_below);
  for (std::int32_t bit = 0; bit < kMaxAckDistance; ++bit) {
    const std::size_t index = object.received_below + 1 + static_cast<std::size_t>(bit);
    if (index < object.received.size() && object.received[index]) ack.received_mask |= std::uint64_t{1} << bit;
  }
  ack.credit = Credit();
  return ack;
}

ChunkAck BulkReceiver::CompleteAck(bool of_reply) const {
  ChunkAck ack;
  ack.of_reply = of_reply;
  ack.complete = true;
  ack.credit = Credit();
  return ack;
}

void BulkReceiver::OnTimer(microseconds now) {
  for (auto object = objects_.begin(); object != objects_.end();) {
    const auto next = std::next(object);
    if (now - object->second.last_chunk >= limits_.lifetime) {
      ++counters_.objects_expired;
      Remove(object);
    }
    object = next;
  }
}

std::optional<microseconds> BulkReceiver::next_timer() const {
  std::optional<microseconds> earliest;
  for (const auto& [key, object] : objects_) {
    const microseconds due = object.last_chunk + limits_.lifetime;
    if (!earliest || due < *earliest) earliest = due;
  }
  return earliest;
}

}  // namespace legopt::bus
