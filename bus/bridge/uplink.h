#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bridge/bridge.h"
#include "bus/bridge/link_socket.h"
#include "bus/lcm_transport.h"

/// @file
/// Connection of a worker or client to its server, with or without an access file.

namespace legopt::bridge {

/// How a party reaches its server: on the server's bus, or with a bridge from its own bus.
struct ServerUplink {
  bus::LcmOptions network;                       ///< bus that the party joins
  std::string bus;                               ///< location of that bus, for humans; empty: the server's bus
  std::string server_address;                    ///< address of the server, for messages
  std::vector<LinkAddress> hub;                  ///< addresses of the hub; empty: no bridge
  std::optional<LinkSocket> socket;              ///< socket of the bridge
  bool bridged() const { return !hub.empty(); }  ///< whether a bridge is used
};

/// Location of the bus of a party with a bridge.
enum class BusLocation {
  kOwnNamespace,  ///< a new network namespace of this process if the kernel permits it, else as kOwnPorts. Requires a
                  ///< single thread; afterwards the process has no other network
  kOwnPorts       ///< free ports of this machine
};

/// Prepares the connection. With an access file: a separate bus and a socket to the outside. Throws bus::BusError.
ServerUplink PrepareUplink(const bus::LcmOptions& network, const std::optional<std::string>& access_file,
                           BusLocation place);

/// Runs the party's end of the bridge; returns null if there is none. Throws bus::BusError.
std::unique_ptr<Bridge> RunSpoke(ServerUplink uplink);

}  // namespace legopt::bridge
