#pragma once

#include <chrono>
#include <string>

#include "bus/bus_error.h"

/// @file
/// Checks with system calls whether a multicast group and port work, before LCM uses them. LCM itself would print to
/// stderr and, behind a firewall, block for ten seconds. Private to bus; ProbeMulticastRoute() of lcm_transport.h is
/// the public interface.

namespace legopt::bus {

/// Result of a probe.
struct ProbeResult {
  bool usable = false;                                 ///< the datagram came back
  BusErrorCode code = BusErrorCode::kNetworkUnusable;  ///< reason if not usable
  std::string problem;                                 ///< problem and fix if not usable
  std::string interface;                               ///< interface that carries the group, if known
};

/// Binds `port` (0: any free port), joins the group, sends a datagram with TTL 0 to it and waits at most `patience` for
/// the datagram to arrive. Uses loopback for `ttl` 0, otherwise the interface to which the routes send the group. The
/// datagram is the one of LCM's self-test, so it does not disturb other parties on the port.
ProbeResult ProbeMulticast(const std::string& group, int port, std::chrono::milliseconds patience, int ttl);

}  // namespace legopt::bus
