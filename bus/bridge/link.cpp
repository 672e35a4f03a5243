#include "bus/bridge/link.h"

#include <cstdio>
#include <cstdlib>
#include <optional>

#include "bus/message_key.h"
#include "bus/wire.h"

namespace legopt::bridge {
namespace {

constexpr std::uint32_t kMagic = 0x4C474252;  // "LGBR"; frames begin differently, so their tags never match
constexpr std::uint8_t kEnvelopeVersion = 1;
constexpr std::size_t kEnvelopeTagOffset = 48;

bool FieldsAreInRange(const EnvelopeHeader& header, std::uint8_t version, std::uint8_t port, std::uint8_t zero) {
  const auto kind = static_cast<std::uint8_t>(header.kind);
  return version == kEnvelopeVersion && kind >= 1 && kind <= kLastEnvelopeKind && port <= 1 && zero == 0 &&
         header.link >= 1 && header.hub >= 0 && header.nonce >= 1 && header.value >= 0;
}

}  // namespace

std::span<const std::uint8_t> SealEnvelope(const EnvelopeHeader& header, std::span<const std::uint8_t> frame,
                                           EnvelopeBuffer& buffer, const bus::MessageKey* key) {
  if (frame.size() > bus::kMaxDatagramBytes) {
    std::fprintf(stderr, "legopt bridge: broken invariant: frame of %zu bytes, limit %zu\n", frame.size(),
                 bus::kMaxDatagramBytes);
    std::abort();
  }
  bus::Writer writer(buffer.data());
  writer.Put(kMagic)
      .Put(kEnvelopeVersion)
      .Put(static_cast<std::uint8_t>(header.kind))
      .Put(static_cast<std::uint8_t>(header.port))
      .Put(std::uint8_t{0})
      .Put(header.deployment)
      .Put(header.link)
      .Put(header.hub)
      .Put(header.nonce)
      .Put(header.value);
  bus::Writer(writer.at() + bus::kTagBytes).Bytes(frame);
  const std::span<const std::uint8_t> datagram(buffer.data(), kEnvelopeHeaderBytes + frame.size());
  writer.Bytes(bus::ComputeTag(datagram, kEnvelopeTagOffset, bus::KeyOfRole(key, header.role)));
  return datagram;
}

EnvelopeFault OpenEnvelope(std::span<const std::uint8_t> datagram, std::int64_t deployment, const bus::MessageKey* key,
                           EnvelopeView& envelope) {
  if (datagram.size() < kEnvelopeHeaderBytes || datagram.size() > kMaxEnvelopeBytes) return EnvelopeFault::kMalformed;
  bus::Reader reader(datagram.data());
  if (reader.Get<std::uint32_t>() != kMagic) return EnvelopeFault::kMalformed;
  EnvelopeHeader& header = envelope.header;
  const auto version = reader.Get<std::uint8_t>();
  header.kind = static_cast<EnvelopeKind>(reader.Get<std::uint8_t>());
  const auto port = reader.Get<std::uint8_t>();
  const auto zero = reader.Get<std::uint8_t>();
  header.port = static_cast<bus::Port>(port);
  header.deployment = reader.Get<std::int64_t>();
  header.link = reader.Get<std::int64_t>();
  header.hub = reader.Get<std::int64_t>();
  header.nonce = reader.Get<std::int64_t>();
  header.value = reader.Get<std::int64_t>();
  envelope.frame = datagram.subspan(kEnvelopeHeaderBytes);
  if (!FieldsAreInRange(header, version, port, zero)) return EnvelopeFault::kMalformed;
  if (envelope.frame.empty() == (header.kind == EnvelopeKind::kFrame)) return EnvelopeFault::kMalformed;
  if (header.deployment != deployment) return EnvelopeFault::kDeployment;
  const std::optional<bus::KeyRole> role = bus::RoleOfTag(datagram, kEnvelopeTagOffset, key);
  header.role = role.value_or(bus::KeyRole::kOperator);
  return role ? EnvelopeFault::kNone : EnvelopeFault::kTag;
}

namespace {

constexpr std::size_t kSenderOffset = 24;  // offset in a frame; its destination follows

}  // namespace

std::vector<std::pair<std::string_view, std::uint64_t>> LinkCounters::Listing() const {
  return {{"forwarded_up", forwarded_up},
          {"forwarded_down", forwarded_down},
          {"not_for_the_bridge", not_for_the_bridge},
          {"no_route", no_route},
          {"rejected_malformed", rejected_malformed},
          {"rejected_deployment", rejected_deployment},
          {"rejected_tag", rejected_tag},
          {"rejected_unproven", rejected_unproven},
          {"rejected_replay", rejected_replay},
          {"rejected_direction", rejected_direction}};
}

FrameRoute FrameRouteOf(std::span<const std::uint8_t> frame) {
  if (frame.size() < bus::kFrameHeaderBytes) return {};
  bus::Reader reader(frame.subspan(kSenderOffset).data());
  const auto sender = reader.Get<bus::EndpointId>();
  const auto destination = reader.Get<bus::EndpointId>();
  if (sender > bus::kServerCandidate && destination == bus::kServer) return {Direction::kUp, sender};
  if (sender == bus::kServer && destination > bus::kServerCandidate) return {Direction::kDown, destination};
  return {};
}

std::optional<bus::KeyRole> CheckFrameTag(std::span<const std::uint8_t> frame, const DeploymentIdentity& membership,
                                          LinkCounters& counters) {
  bus::FrameView view;
  switch (bus::OpenFrame(frame, membership.deployment, bus::kAnyDestination, view, membership.key)) {
    case bus::FrameFault::kNone:
    case bus::FrameFault::kVersion:
      return view.header.role;
    case bus::FrameFault::kSize:
    case bus::FrameFault::kMalformed:
    case bus::FrameFault::kField:
    case bus::FrameFault::kNotForUs:
      ++counters.rejected_malformed;
      return std::nullopt;
    case bus::FrameFault::kDeployment:
      ++counters.rejected_deployment;
      return std::nullopt;
    case bus::FrameFault::kTag:
    case bus::FrameFault::kUnsigned:
      ++counters.rejected_tag;
      return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace legopt::bridge
