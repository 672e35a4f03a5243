#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/bridge.h"
#include "bridge/link_socket.h"
#include "bus/lcm_transport.h"

namespace legopt::worker {

/// How a worker reaches its server: on the server's own bus, or over a bridge from a bus of the worker's own.
struct Uplink {
  bus::LcmOptions network;                       ///< the bus that the worker joins
  std::string bus;                               ///< where that is, for people; empty: on the server's bus
  std::string server_address;                    ///< for messages
  std::vector<bridge::LinkAddress> hub;          ///< where the bridge leads; empty: there is none
  std::optional<bridge::LinkSocket> socket;      ///< of the bridge
  bool bridged() const { return !hub.empty(); }  ///< over a bridge
};

/// With an access file: a bus of this worker's own, in a network namespace where the kernel allows it, else on free
/// ports of this machine; and a socket outwards. This process is in that namespace then, so there must not be a second
/// thread yet. Throws bus::BusError.
Uplink FindUplink(const bus::LcmOptions& network, const std::optional<std::string>& access_file);

/// The worker's end of the bridge at work; null when there is none.
std::unique_ptr<bridge::Bridge> RunSpoke(Uplink uplink);

}  // namespace legopt::worker
