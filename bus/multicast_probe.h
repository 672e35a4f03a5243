#pragma once

#include <chrono>
#include <string>

#include "bus/bus_error.h"

/// @file
/// Asks the kernel, before LCM does, whether a multicast group and port work. LCM itself would print to stderr and,
/// behind a firewall, block for ten seconds. Private to bus; ProbeMulticastRoute() of lcm_transport.h is the public
/// face.

namespace legopt::bus {

/// What a probe found.
struct ProbeResult {
  bool usable = false;                                 ///< the datagram came back
  BusErrorCode code = BusErrorCode::kNetworkUnusable;  ///< when not usable
  std::string problem;                                 ///< when not usable: what is wrong and what fixes it
  std::string interface;                               ///< that carries the group, when known
};

/// Binds `port` (0: any free one), joins, sends itself a datagram with TTL 0 and waits at most `patience` for it. With
/// `ttl` 0 it does so on loopback, else on the interface to which the routes send the group. The datagram is that of
/// LCM's own self-test, so other parties on the port are not disturbed.
ProbeResult ProbeMulticast(const std::string& group, int port, std::chrono::milliseconds patience, int ttl);

}  // namespace legopt::bus
