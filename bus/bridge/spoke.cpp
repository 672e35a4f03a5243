#include "bus/bridge/spoke.h"

#include <algorithm>
#include <utility>

#include "bus/wire.h"

namespace legopt::bridge {

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
