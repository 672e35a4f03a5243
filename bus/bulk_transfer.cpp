#include "bus/bulk_transfer.h"

#include <algorithm>
#include <cstring>

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::size_t kFirstCredit = 8;  // initial value until the receiver has sent its own
constexpr std::int32_t kAckEvery = 8;
constexpr std::int64_t kReorderTolerance = 3;  // later transmissions acknowledged before a chunk counts as lost
constexpr microseconds kFirstTimeout = milliseconds(100);
constexpr microseconds kMinTimeout = milliseconds(20);
constexpr microseconds kMaxTimeout = seconds(1);
constexpr microseconds kPatience = seconds(10);
constexpr int kMaxBackOff = 6;

std::span<const std::uint8_t> Bytes(const std::string& body) {
  return {reinterpret_cast<const std::uint8_t*>(body.data()), body.size()};
}

}  // namespace

BulkSender::BulkSender(Counters& counters, Emit emit, Done done)
    : counters_(counters), emit_(std::move(emit)), done_(std::move(done)) {}

void BulkSender::Start(const ObjectKey& key, std::int16_t type, Body body, microseconds now) {
  Cancel(key, now);
  Object object;
  object.type = type;
  object.hash = HashObject(Bytes(*body));
  object.acked.resize(NumChunks(body->size()));
  object.last_progress = now;
  object.body = std::move(body);
  held_bytes_ += object.body->size();
  objects_.emplace(key, std::move(object));
  Peer& peer = peers_.try_emplace(PeerOf(key), Peer{.credit = kFirstCredit, .waiting = {}}).first->second;
  peer.waiting.push_back(key);
  Fill(PeerOf(key), now);
}

void BulkSender::RequestAck(const ObjectKey& key, std::int16_t type, const Body& body) {
  if (Sending(key)) return;
  Object object;
  object.body = body;
  object.hash = HashObject(Bytes(*body));
  emit_(key, type, MakeChunk(object, 0, true));
  ++counters_.chunks_resent;
}

ChunkView BulkSender::MakeChunk(const Object& object, std::int32_t index, bool ack_requested) const {
  ChunkView chunk;
  chunk.total_bytes = static_cast<std::int64_t>(object.body->size());
  chunk.hash = object.hash;
  chunk.index = index;
  chunk.ack_requested = ack_requested;
  const std::size_t offset = static_cast<std::size_t>(index) * kChunkBytes;
  chunk.data = Bytes(*object.body).subspan(offset, std::min(kChunkBytes, object.body->size() - offset));
  return chunk;
}

void BulkSender::Cancel(const ObjectKey& key, microseconds now) {
  const auto object = objects_.find(key);
  if (object == objects_.end()) return;
  Remove(object);
  Fill(PeerOf(key), now);  // other bodies may use the window
}

void BulkSender::Remove(Objects::iterator object) {
  const ObjectKey key = object->first;
  timers_.erase({object->second.timer, key});
  held_bytes_ -= object->second.body->size();
  const auto peer = peers_.find(PeerOf(key));
  peer->second.in_flight -= object->second.flights.size();
  std::erase(peer->second.waiting, key);
  objects_.erase(object);
}

bool BulkSender::HasMore(const Object& object) {
  return !object.lost.empty() || (object.next_new < static_cast<std::int32_t>(object.acked.size()) &&
                                  object.next_new - object.first_unacked < kMaxAckDistance);
}

// Shares the peer's window among its bodies, one chunk each in turn.
void BulkSender::Fill(const PeerKey& peer_id, microseconds now) {
  const auto found = peers_.find(peer_id);
  if (found == peers_.end()) return;
  Peer& peer = found->second;
  std::set<ObjectKey> touched;
  for (std::size_t idle = 0; idle < peer.waiting.size() && peer.in_flight < peer.credit;) {
    const ObjectKey key = peer.waiting.front();
    peer.waiting.pop_front();
    peer.waiting.push_back(key);
    if (EmitNext(key, objects_.at(key), peer, now)) {
      touched.insert(key);
      idle = 0;
    } else {
      ++idle;
    }
  }
  for (const ObjectKey& key : touched) Rearm(key, objects_.at(key), peer);
  constexpr std::size_t kManyPeers = 1024;
  if (peer.waiting.empty() && peers_.size() > kManyPeers) peers_.erase(found);  // cheap to measure again
}

bool BulkSender::EmitNext(const ObjectKey& key, Object& object, Peer& peer, microseconds now) {
  if (!HasMore(object)) return false;
  const bool again = !object.lost.empty();
  std::int32_t index = object.next_new;
  if (again) {
    index = *object.lost.begin();
    object.lost.erase(object.lost.begin());
    ++counters_.chunks_resent;
  } else {
    ++object.next_new;
  }
  ++peer.in_flight;
  object.flights.push_back({index, ++peer.order, now, again});
  const bool pause = peer.in_flight >= peer.credit || !HasMore(object);
  emit_(key, object.type, MakeChunk(object, index, again || pause || index % kAckEvery == kAckEvery - 1));
  ++counters_.chunks_sent;
  return true;
}

bool BulkSender::OnAck(const ObjectKey& key, const ChunkAck& ack, microseconds now) {
  const auto found = objects_.find(key);
  if (found == objects_.end()) return false;
  Object& object = found->second;
  Peer& peer = peers_.at(PeerOf(key));
  peer.credit = static_cast<std::size_t>(ack.credit);
  const auto count = static_cast<std::int32_t>(object.acked.size());
  if (ack.complete) {
    Remove(found);
    ++counters_.objects_sent;
    Fill(PeerOf(key), now);
    done_(key, true);
    return true;
  }
  if (ack.reassembly == object.past_reassembly && ack.reassembly != 0) return true;
  if (ack.reassembly != object.reassembly) {
    if (object.reassembly != 0) RestartTransfer(object, peer);
    object.past_reassembly = object.reassembly;
    object.reassembly = ack.reassembly;
  }
  const std::int32_t below = std::min(ack.received_below, object.next_new);
  for (std::int32_t i = object.first_unacked; i < below; ++i) Acknowledge(object, peer, i, now);
  for (std::int32_t bit = 0; bit < kMaxAckDistance; ++bit) {
    if (((ack.received_mask >> bit) & 1U) == 0) continue;
    const std::int64_t index = std::int64_t{ack.received_below} + 1 + bit;
    if (index < object.next_new) Acknowledge(object, peer, static_cast<std::int32_t>(index), now);
  }
  while (object.first_unacked < count && object.acked[static_cast<std::size_t>(object.first_unacked)]) {
    ++object.first_unacked;
  }
  DetectLoss(object, peer, now);
  Rearm(key, object, peer);
  Fill(PeerOf(key), now);
  return true;
}

// Restarts a body after the receiver has lost its chunks: it was restarted, timed out, or the hash did not match.
void BulkSender::RestartTransfer(Object& object, Peer& peer) {
  peer.in_flight -= object.flights.size();
  object.flights.clear();
  object.lost.clear();
  object.acked.assign(object.acked.size(), false);
  object.first_unacked = 0;
  object.next_new = 0;
}

void BulkSender::Acknowledge(Object& object, Peer& peer, std::int32_t index, microseconds now) {
  if (object.acked[static_cast<std::size_t>(index)]) return;
  object.acked[static_cast<std::size_t>(index)] = true;
  object.lost.erase(index);
  object.back_off = 0;
  object.last_progress = now;
  const auto flight =
      std::find_if(object.flights.begin(), object.flights.end(), [&](const Flight& f) { return f.index == index; });
  if (flight == object.flights.end()) return;  // was considered lost, but arrived late
  if (!flight->resent) MeasureRtt(peer, now - flight->sent);
  object.highest_acked_order = std::max(object.highest_acked_order, flight->order);
  object.flights.erase(flight);
  --peer.in_flight;
}

// Follows RFC 6298. Uses only samples of chunks that were sent once.
void BulkSender::MeasureRtt(Peer& peer, microseconds sample) {
  sample = std::max(sample, microseconds(1));
  if (peer.smoothed_rtt.count() == 0) {
    peer.smoothed_rtt = sample;
    peer.rtt_deviation = sample / 2;
    return;
  }
  const microseconds error = sample - peer.smoothed_rtt;
  peer.rtt_deviation += (std::chrono::abs(error) - peer.rtt_deviation) / 4;
  peer.smoothed_rtt += error / 8;
}

void BulkSender::DetectLoss(Object& object, Peer& peer, microseconds now) {
  std::erase_if(object.flights, [&](const Flight& flight) {
    const bool overtaken = flight.order + kReorderTolerance <= object.highest_acked_order;
    if (!overtaken || now - flight.sent < peer.smoothed_rtt) return false;
    object.lost.insert(flight.index);
    --peer.in_flight;
    return true;
  });
}

microseconds BulkSender::RetransmitTimeout(const Object& object, const Peer& peer) const {
  microseconds timeout = kFirstTimeout;
  if (peer.smoothed_rtt.count() > 0) timeout = std::max(kMinTimeout, peer.smoothed_rtt + 4 * peer.rtt_deviation);
  return std::min(kMaxTimeout, timeout * (1 << object.back_off));
}

void BulkSender::Rearm(const ObjectKey& key, Object& object, const Peer& peer) {
  timers_.erase({object.timer, key});
  microseconds timer = object.last_progress + kPatience;
  const microseconds timeout = RetransmitTimeout(object, peer);
  for (const Flight& flight : object.flights) timer = std::min(timer, flight.sent + timeout);
  object.timer = timer;
  timers_.insert({timer, key});
}

void BulkSender::OnTimer(microseconds now) {
  while (!timers_.empty() && timers_.begin()->first <= now) {
    const ObjectKey key = timers_.begin()->second;
    const auto found = objects_.find(key);
    Object& object = found->second;
    Peer& peer = peers_.at(PeerOf(key));
    if (now - object.last_progress >= kPatience) {
      Remove(found);
      ++counters_.objects_expired;
      Fill(PeerOf(key), now);
      done_(key, false);
      continue;
    }
    const microseconds timeout = RetransmitTimeout(object, peer);
    const std::size_t before = object.flights.size();
    std::erase_if(object.flights, [&](const Flight& flight) {
      if (now - flight.sent < timeout) return false;
      object.lost.insert(flight.index);
      --peer.in_flight;
      return true;
    });
    if (object.flights.size() < before) object.back_off = std::min(object.back_off + 1, kMaxBackOff);
    Rearm(key, object, peer);
    Fill(PeerOf(key), now);
  }
}

std::optional<microseconds> BulkSender::next_timer() const {
  if (timers_.empty()) return std::nullopt;
  return timers_.begin()->first;
}

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
