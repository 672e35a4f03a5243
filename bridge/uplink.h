#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bridge/bridge.h"
#include "bridge/link_socket.h"
#include "bus/lcm_transport.h"

/// @file
/// The way of a worker or client to its server, with or without an access file.

namespace legopt::bridge {

/// How a party reaches its server: on the server's own bus, or over a bridge from a bus of the party's own.
struct Uplink {
  bus::LcmOptions network;                       ///< the bus that the party joins
  std::string bus;                               ///< where that is, for people; empty: on the server's bus
  std::string server_address;                    ///< for messages
  std::vector<LinkAddress> hub;                  ///< where the bridge leads; empty: there is none
  std::optional<LinkSocket> socket;              ///< of the bridge
  bool bridged() const { return !hub.empty(); }  ///< over a bridge
};

/// Where the bus of a bridged party is.
enum class BusPlace {
  kOwnNamespace,  ///< a network namespace of this process where the kernel allows it, else as kOwnPorts: no second
                  ///< thread may have begun, and this process has no other network afterwards
  kOwnPorts       ///< free ports of this machine
};

/// With an access file: a bus of this party's own, and a socket outwards. Throws bus::BusError.
Uplink FindUplink(const bus::LcmOptions& network, const std::optional<std::string>& access_file, BusPlace place);

/// The party's end of the bridge at work; null when there is none. Throws bus::BusError.
std::unique_ptr<Bridge> RunSpoke(Uplink uplink);

}  // namespace legopt::bridge
