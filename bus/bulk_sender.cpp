#include "bus/bulk_sender.h"

#include <algorithm>

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

}  // namespace legopt::bus
