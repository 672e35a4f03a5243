#pragma once

#include <cstdint>

#include "programs/external/solver_launcher.h"

namespace legopt::external {

/// One packet to the launcher.
struct LaunchRequest {
  enum class Kind : std::uint8_t { kStart, kCount, kEnd } kind = Kind::kStart;  ///< what is asked
  bool leaving = false;                                                         ///< of kEnd
  std::uint32_t command = 0;                                                    ///< of kStart
  std::int64_t memory_bytes = 0;                                                ///< of kStart
};

/// Its answer; with it come the solver's streams and its pidfd, four descriptors, when one was started.
struct LaunchReply {
  int error = 0;   ///< errno of kStart
  ProcessEnd end;  ///< of kEnd
};

/// The launcher's life after the fork, as a child of `owner`. Returns its exit status.
int ServeLaunches(int socket, std::span<const LaunchCommand> commands);

}  // namespace legopt::external
