#include "bus/bridge/link_end.h"

#include "bus/big_endian.h"
#include "bus/wire.h"

namespace legopt::bridge {
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
