#pragma once

#include <cstdint>

#include "worker/external/solver_launcher.h"

namespace legopt::external {

/// Packet to the launcher.
struct LaunchRequest {
  enum class Kind : std::uint8_t { kStart, kCount, kEnd } kind = Kind::kStart;
  bool leaving = false;           ///< kEnd: the solver is about to exit by itself
  std::uint32_t command = 0;      ///< kStart: index of the command
  std::int64_t memory_bytes = 0;  ///< kStart: memory limit
};

/// Answer of the launcher. If a solver was started, four descriptors come with it: its three streams and its pidfd.
struct LaunchReply {
  int error = 0;   ///< errno of kStart
  ProcessEnd end;  ///< result of kEnd
};

/// Main function of the launcher after the fork, as a child of `owner`. Returns its exit status.
int ServeLaunches(int socket, std::span<const LaunchCommand> commands);

}  // namespace legopt::external
