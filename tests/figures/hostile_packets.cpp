#include "tests/figures/hostile_packets.h"

#include <algorithm>
#include <string_view>

#include "bus/wire.h"

namespace legopt::figures {
namespace {

using std::string_view_literals::operator""sv;

constexpr auto kShortForm = "LC02\0\0\0\0"sv;
constexpr auto kChannel = "LEGOPT\0"sv;
// Fragment 0 of 2 of a message of 4 GiB, which crashes LCM 1.3.1 (docs/explanation/reliability.md#what-lcm-and-udp-do).
constexpr auto kLongForm = "LC03\0\0\0\1\xff\xff\xff\xff\xff\xff\xff\xf0\0\0\0\2LEGOPT\0"sv;
constexpr std::size_t kDestinationBegin = 32, kDestinationEnd = 40;  // unchanged, since another party's frames are no
                                                                     // fault
constexpr std::size_t kMaxPayload = 300;

}  // namespace

std::string HostilePackets::Noise(std::size_t most) {
  std::string bytes(Below(most + 1), '\0');
  for (char& byte : bytes) byte = static_cast<char>(random_());
  return bytes;
}

// Returns a frame to the server with a valid tag.
std::string HostilePackets::Frame() {
  bus::FrameHeader header;
  header.kind = static_cast<bus::FrameKind>(1 + Below(bus::kLastFrameKind));
  header.type = static_cast<std::int16_t>(1 + Below(bus::kLastMessageType));
  header.deployment = deployment_;
  header.sender = static_cast<std::int64_t>(random_() >> 1U) | 1;
  header.destination = bus::kServer;
  header.session = 1;
  header.call_id = 1;
  bus::DatagramBuffer buffer{};
  const std::string payload = Noise(kMaxPayload);
  std::copy(payload.begin(), payload.end(), buffer.begin() + bus::kFrameHeaderBytes);
  const auto frame = bus::SealFrame(header, payload.size(), buffer);
  return {frame.begin(), frame.end()};
}

HostilePacket HostilePackets::Draw() {
  switch (Below(6)) {
    case 0:
      return {Noise(kMaxPayload) + "x", false};
    case 1: {  // LCM stores every channel that it receives
      std::string channel = std::to_string(random_());
      channel.push_back('\0');
      return {std::string(kShortForm) + channel + Noise(kMaxPayload), false};
    }
    case 2:
      return {std::string(kLongForm) + Noise(kMaxPayload), false};
    case 3:
      return {std::string(kShortForm) + std::string(kChannel) + "x" + Noise(kMaxPayload), true};
    case 4: {  // cut
      std::string frame = Frame();
      frame.resize(1 + Below(frame.size() - 1));
      return {std::string(kShortForm) + std::string(kChannel) + frame, true};
    }
    default: {  // one bit of it is flipped
      std::string frame = Frame();
      std::size_t at = 0;
      do at = Below(frame.size());
      while (at >= kDestinationBegin && at < kDestinationEnd);
      frame[at] = static_cast<char>(frame[at] ^ (1 << Below(8)));
      return {std::string(kShortForm) + std::string(kChannel) + frame, true};
    }
  }
}

}  // namespace legopt::figures
