#include "bus/bridge/hub_and_spoke.h"

#include <algorithm>
#include <optional>
#include <random>
#include <utility>

#include "bus/wire.h"

namespace legopt::bridge {
namespace {

std::int64_t DrawLife(std::uint64_t seed) {
  constexpr std::uint64_t kOtherThanTheGuards = 0x9E3779B97F4A7C15ULL;
  return static_cast<std::int64_t>(std::mt19937_64(seed ^ kOtherThanTheGuards)() >> 1U) | 1;
}

}  // namespace

Hub::Hub(const DeploymentIdentity& membership, std::uint64_t seed, Carrier& carrier, const HubOptions& options)
    : membership_(membership),
      options_(options),
      carrier_(carrier),
      guard_(options.max_links, seed),
      life_(DrawLife(seed)) {
  bus::PrepareHashing();
}

void Hub::OnBus(bus::Port port, std::span<const std::uint8_t> datagram, microseconds /*now*/) {
  const FrameRoute frame_route = FrameRouteOf(datagram);
  if (frame_route.direction != Direction::kDown) {
    ++counters_.not_for_the_bridge;
    return;
  }
  const auto route = routes_.find(frame_route.party);
  if (route == routes_.end()) {
    ++counters_.no_route;
    return;
  }
  const std::optional<bus::KeyRole> role = CheckFrameTag(datagram, membership_, counters_);
  if (!role) return;
  if (*role != route->second.party_role) {
    ++counters_.rejected_direction;
    return;
  }
  ++counters_.forwarded_down;
  EnvelopeHeader header;
  header.kind = EnvelopeKind::kFrame;
  header.port = port;
  header.link = route->second.link;
  header.role = route->second.link_role;
  SendDown(route->second.address, header, datagram);
}

void Hub::OnLink(LinkAddress from, std::span<const std::uint8_t> datagram, microseconds now) {
  EnvelopeView envelope;
  switch (OpenEnvelope(datagram, membership_.deployment, membership_.key, envelope)) {
    case EnvelopeFault::kMalformed:
      ++counters_.rejected_malformed;
      return;
    case EnvelopeFault::kDeployment:
      ++counters_.rejected_deployment;
      return;
    case EnvelopeFault::kTag:
      ++counters_.rejected_tag;
      return;
    case EnvelopeFault::kNone:
      break;
  }
  const EnvelopeHeader& header = envelope.header;
  // Rejects an envelope of a hub that was sent back to it.
  if (header.hub != 0) {
    ++counters_.rejected_direction;
    return;
  }
  if (header.kind == EnvelopeKind::kProof) {
    if (guard_.Prove(header.link, header.link, header.nonce, header.value, header.role)) {
      Answer(from, header, EnvelopeKind::kAlive, header.nonce);
    } else {
      ++counters_.rejected_replay;
    }
    return;
  }
  switch (guard_.Check(header.link, header.link, header.nonce, header.role)) {
    case bus::ReplayGuard::Verdict::kUnproven:
      ++counters_.rejected_unproven;
      Answer(from, header, EnvelopeKind::kChallenge, guard_.challenge());
      return;
    case bus::ReplayGuard::Verdict::kReplayed:
      ++counters_.rejected_replay;
      return;
    case bus::ReplayGuard::Verdict::kFresh:
      break;
  }
  if (header.kind == EnvelopeKind::kKnock) Answer(from, header, EnvelopeKind::kAlive, header.nonce);
  if (header.kind == EnvelopeKind::kFrame) HandleUpFrame(from, envelope, now);
}

void Hub::HandleUpFrame(LinkAddress from, const EnvelopeView& envelope, microseconds now) {
  const FrameRoute frame_route = FrameRouteOf(envelope.frame);
  if (frame_route.direction != Direction::kUp) {
    ++counters_.rejected_direction;
    return;
  }
  const std::optional<bus::KeyRole> role = CheckFrameTag(envelope.frame, membership_, counters_);
  if (!role) return;
  // A spoke with a derived key may send only frames made with that key.
  const bus::KeyRole link_role = envelope.header.role;
  const bool is_of_link = link_role == bus::KeyRole::kOperator || link_role == *role;
  if (!is_of_link || !UpdateRoute(frame_route.party, {from, envelope.header.link, link_role, *role, now, {}})) {
    ++counters_.rejected_direction;
    return;
  }
  ++counters_.forwarded_up;
  carrier_.ToBus(envelope.header.port, envelope.frame);
}

// Stores the route to a party. Returns false if the address belongs to a party with a key of another role.
bool Hub::UpdateRoute(bus::EndpointId party, const Route& route) {
  const auto found = routes_.find(party);
  if (found != routes_.end()) {
    if (found->second.party_role != route.party_role) return false;
    const auto recency = found->second.recency;
    found->second = route;
    found->second.recency = recency;
    recency_.splice(recency_.end(), recency_, recency);
    return true;
  }
  while (routes_.size() >= options_.max_routes) EvictOldestRoute();
  const auto learnt = routes_.emplace(party, route).first;
  learnt->second.recency = recency_.insert(recency_.end(), party);
  return true;
}

void Hub::EvictOldestRoute() {
  routes_.erase(recency_.front());
  recency_.pop_front();
}

void Hub::Answer(LinkAddress to, const EnvelopeHeader& question, EnvelopeKind kind, std::int64_t value) {
  EnvelopeHeader header;
  header.kind = kind;
  header.link = question.link;
  header.role = question.role;
  header.value = value;
  SendDown(to, header, {});
}

void Hub::SendDown(LinkAddress to, EnvelopeHeader header, std::span<const std::uint8_t> frame) {
  header.deployment = membership_.deployment;
  header.hub = life_;
  header.nonce = ++nonce_;
  EnvelopeBuffer buffer;
  carrier_.ToLink(to, SealEnvelope(header, frame, buffer, membership_.key));
}

void Hub::Tick(microseconds now) {
  while (!recency_.empty() && now - routes_.at(recency_.front()).heard >= options_.route_life) EvictOldestRoute();
}

microseconds Hub::next_deadline() const {
  if (recency_.empty()) return microseconds::max();
  return routes_.at(recency_.front()).heard + options_.route_life;
}

Spoke::Spoke(const DeploymentIdentity& membership, std::vector<LinkAddress> hub, std::uint64_t seed, Carrier& carrier,
             const SpokeOptions& options)
    : membership_(membership),
      options_(options),
      carrier_(carrier),
      addresses_(std::move(hub)),
      random_(seed),
      link_(static_cast<std::int64_t>(random_() >> 1U) | 1),
      knock_interval_(options.first_knock) {
  bus::PrepareHashing();
}

void Spoke::OnBus(bus::Port port, std::span<const std::uint8_t> datagram, microseconds /*now*/) {
  if (FrameRouteOf(datagram).direction != Direction::kUp) {
    ++counters_.not_for_the_bridge;
    return;
  }
  if (!chosen_) {
    ++counters_.no_route;
    return;
  }
  if (!CheckFrameTag(datagram, membership_, counters_)) return;
  ++counters_.forwarded_up;
  EnvelopeHeader header;
  header.kind = EnvelopeKind::kFrame;
  header.port = port;
  SendUp(*chosen_, header, datagram);
}

void Spoke::OnLink(LinkAddress from, std::span<const std::uint8_t> datagram, microseconds now) {
  EnvelopeView envelope;
  switch (OpenEnvelope(datagram, membership_.deployment, membership_.key, envelope)) {
    case EnvelopeFault::kMalformed:
      ++counters_.rejected_malformed;
      return;
    case EnvelopeFault::kDeployment:
      ++counters_.rejected_deployment;
      return;
    case EnvelopeFault::kTag:
      ++counters_.rejected_tag;
      return;
    case EnvelopeFault::kNone:
      break;
  }
  const EnvelopeHeader& header = envelope.header;
  if (header.role != membership_.role()) {  // a hub answers with the key of its spoke's role
    ++counters_.rejected_tag;
    return;
  }
  if (header.hub == 0 || header.link != link_) {
    ++counters_.rejected_direction;
    return;
  }
  switch (header.kind) {
    case EnvelopeKind::kChallenge:
      // An outdated challenge is harmless: no hub accepts its proof.
      SendUp(from, EnvelopeKind::kProof, header.value);
      return;
    case EnvelopeKind::kAlive:
      HandleAlive(from, header, now);
      return;
    case EnvelopeKind::kFrame:
      HandleDownFrame(envelope, now);
      return;
    case EnvelopeKind::kKnock:
    case EnvelopeKind::kProof:
      ++counters_.rejected_direction;
      return;
  }
}

// The answer contains a nonce of this spoke that was not answered before, so it was made after that knock and is no
// recording. Accepting only addresses of the hub prevents another party from relaying answers from elsewhere.
void Spoke::HandleAlive(LinkAddress from, const EnvelopeHeader& header, microseconds now) {
  if (header.value <= answered_ || header.value > nonce_) {
    ++counters_.rejected_replay;
    return;
  }
  if (std::find(addresses_.begin(), addresses_.end(), from) == addresses_.end()) {
    ++counters_.rejected_direction;
    return;
  }
  // At the start several addresses of the same host may answer; the first one is used.
  if (chosen_ && *chosen_ != from) return;
  answered_ = header.value;
  if (header.hub != hub_) {
    hub_ = header.hub;
    window_ = bus::ReplayWindow(header.nonce);
  }
  chosen_ = from;
  last_heard_ = now;
  unanswered_ = false;
  knock_interval_ = options_.first_knock;
  next_knock_ = now + Jittered(options_.keep_alive);
}

void Spoke::HandleDownFrame(const EnvelopeView& envelope, microseconds now) {
  if (envelope.header.hub != hub_ || !window_.Take(envelope.header.nonce)) {
    ++counters_.rejected_replay;
    if (envelope.header.hub != hub_) KnockSoon(now);  // the hub may have been restarted, and its first answer lost
    return;
  }
  last_heard_ = now;
  if (FrameRouteOf(envelope.frame).direction != Direction::kDown) {
    ++counters_.rejected_direction;
    return;
  }
  if (!CheckFrameTag(envelope.frame, membership_, counters_)) return;
  ++counters_.forwarded_down;
  carrier_.ToBus(envelope.header.port, envelope.frame);
}

void Spoke::KnockSoon(microseconds now) { next_knock_ = std::min(next_knock_, now + options_.first_knock); }

void Spoke::Tick(microseconds now) {
  if (now < next_knock_) return;
  if (chosen_ && now - last_heard_ >= options_.silence) chosen_.reset();
  if (chosen_) {
    SendUp(*chosen_, EnvelopeKind::kKnock, 0);
  } else {
    for (const LinkAddress address : addresses_) SendUp(address, EnvelopeKind::kKnock, 0);
  }
  if (unanswered_) knock_interval_ = std::min(2 * knock_interval_, options_.last_knock);
  unanswered_ = true;
  next_knock_ = now + Jittered(knock_interval_);
}

// Multiplies by a random factor in [0.75, 1.25), so that spokes started together do not stay synchronised.
microseconds Spoke::Jittered(microseconds duration) {
  const std::int64_t half = duration.count() / 2;
  if (half == 0) return duration;
  return microseconds(duration.count() - half / 2 +
                      static_cast<std::int64_t>(random_() % static_cast<std::uint64_t>(half)));
}

void Spoke::SendUp(LinkAddress to, EnvelopeKind kind, std::int64_t value) {
  EnvelopeHeader header;
  header.kind = kind;
  header.value = value;
  SendUp(to, header, {});
}

void Spoke::SendUp(LinkAddress to, EnvelopeHeader header, std::span<const std::uint8_t> frame) {
  header.deployment = membership_.deployment;
  header.link = link_;
  header.nonce = ++nonce_;
  header.role = membership_.role();
  EnvelopeBuffer buffer;
  carrier_.ToLink(to, SealEnvelope(header, frame, buffer, membership_.key));
}

}  // namespace legopt::bridge
