// Hostile packets: random bytes, random channels, long-form LCM, invalid frames.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace legopt::figures {

/// A UDP packet, and whether it passes the socket filter of a party. The filter drops packets that are not of LCM's
/// short form or on another channel.
struct HostilePacket {
  std::string bytes;
  bool seen = false;
};

/// Generates random packets for the server of `deployment`. Each one that passes the filter must be refused and
/// counted exactly once.
class HostilePackets {
 public:
  HostilePackets(std::int64_t deployment, std::uint64_t seed) : deployment_(deployment), random_(seed) {}
  HostilePacket Draw();

 private:
  std::string Noise(std::size_t most);
  std::string Frame();
  std::size_t Below(std::size_t bound) { return static_cast<std::size_t>(random_() % bound); }

  std::int64_t deployment_;
  std::mt19937_64 random_;
};

}  // namespace legopt::figures
