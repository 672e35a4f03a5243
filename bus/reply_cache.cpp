#include "bus/reply_cache.h"

#include <algorithm>
#include <utility>

namespace legopt::bus {
namespace {

// Approximate overhead of an entry in addition to its body: map node, list node, control block.
constexpr std::size_t kEntryBytes = 192;

std::size_t Cost(const ReplyCache::Reply& reply) { return kEntryBytes + (reply.body ? reply.body->size() : 0); }

}  // namespace

std::size_t ReplyCache::PeerKeyHash::operator()(const PeerKey& key) const {
  constexpr std::uint64_t kOdd = 0x9E3779B97F4A7C15ULL;
  return (static_cast<std::uint64_t>(key.caller) + static_cast<std::uint64_t>(key.role)) * kOdd ^
         static_cast<std::uint64_t>(key.session);
}

ReplyCache::Lookup ReplyCache::Describe(const Peer& peer, std::int64_t call_id) {
  const auto call = peer.calls.find(call_id);
  if (call != peer.calls.end()) {
    if (!call->second.answered) return {Verdict::kOpen, {}};
    return {Verdict::kAnswered, call->second.reply};
  }
  if (call_id < peer.completed_below) return {Verdict::kFinishedByCaller, {}};
  if (call_id < peer.evicted_below) return {Verdict::kEvicted, {}};
  return {Verdict::kNew, {}};
}

ReplyCache::Lookup ReplyCache::Find(const CallKey& key) const {
  const auto peer = peers_.find({key.caller, key.session, key.role});
  if (peer == peers_.end()) return {Verdict::kNew, {}};
  return Describe(peer->second, key.call_id);
}

ReplyCache::Peers::iterator ReplyCache::Touch(const PeerKey& key) {
  auto [peer, is_new] = peers_.try_emplace(key);
  if (!is_new) {
    recency_.splice(recency_.end(), recency_, peer->second.recency);
    return peer;
  }
  peer->second.recency = recency_.insert(recency_.end(), key);
  if (peers_.size() > limits_.max_peers) EvictPeer(peers_.find(recency_.front()));
  return peer;
}

ReplyCache::Lookup ReplyCache::Open(const CallKey& key, std::int16_t type, std::int64_t completed_below) {
  Peer& peer = Touch({key.caller, key.session, key.role})->second;
  if (completed_below > peer.completed_below) {
    peer.completed_below = completed_below;
    while (!peer.calls.empty() && peer.calls.begin()->first < completed_below)
      EvictReply(peer.calls, peer.calls.begin());
  }
  Lookup lookup = Describe(peer, key.call_id);
  if (lookup.verdict != Verdict::kNew) return lookup;
  if (num_open_ >= limits_.max_open_requests) return {Verdict::kBusy, {}};
  peer.calls.try_emplace(key.call_id).first->second.reply.type = type;
  ++num_open_;
  return lookup;
}

std::optional<ReplyCache::Reply> ReplyCache::Answer(const CallKey& key, std::int16_t error, Body body) {
  const auto peer = peers_.find({key.caller, key.session, key.role});
  if (peer == peers_.end()) return std::nullopt;
  const auto call = peer->second.calls.find(key.call_id);
  if (call == peer->second.calls.end() || call->second.answered) return std::nullopt;
  Entry& entry = call->second;
  entry.answered = true;
  entry.reply.error = error;
  entry.reply.body = std::move(body);
  entry.age = answered_.insert(answered_.end(), key);
  held_bytes_ += Cost(entry.reply);
  --num_open_;
  Reply reply = entry.reply;
  Evict();
  return reply;
}

void ReplyCache::EvictReply(std::map<std::int64_t, Entry>& calls, std::map<std::int64_t, Entry>::iterator call) {
  if (call->second.answered) {
    held_bytes_ -= Cost(call->second.reply);
    answered_.erase(call->second.age);
  } else {
    --num_open_;
  }
  calls.erase(call);
}

void ReplyCache::EvictPeer(Peers::iterator peer) {
  while (!peer->second.calls.empty()) EvictReply(peer->second.calls, peer->second.calls.begin());
  recency_.erase(peer->second.recency);
  peers_.erase(peer);
}

// The newest reply is always kept, so that a single large one can be delivered.
void ReplyCache::Evict() {
  while (held_bytes_ > limits_.max_cached_bytes && answered_.size() > 1) {
    const CallKey oldest = answered_.front();
    Peer& peer = peers_.at({oldest.caller, oldest.session, oldest.role});
    peer.evicted_below = std::max(peer.evicted_below, oldest.call_id + 1);
    EvictReply(peer.calls, peer.calls.find(oldest.call_id));
    ++counters_.replies_evicted;
  }
}

}  // namespace legopt::bus
