// Packets that nobody should send: random bytes, random channels, long-form LCM, frames with something wrong.
#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

namespace legopt::figures {

/// A UDP packet, and whether a party of the deployment sees it: the socket filter keeps away what is not of LCM's short
/// form or not on the channel.
struct HostilePacket {
  std::string bytes;
  bool seen = false;
};

/// Draws packets for the server of `deployment`. Each one that is seen is to be refused and counted exactly once.
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
