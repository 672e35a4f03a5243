// The server's end of the bridge: --listen and --access. Source: PROTOCOL.md, section 14.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "bridge/bridge.h"
#include "bridge/link_socket.h"
#include "bus/lcm_transport.h"
#include "programs/command_line.h"

namespace legopt::server {

/// Where hosts without this one's multicast reach the server.
struct ListenFlags {
  std::optional<std::string> listen;  ///< ADDRESS:PORT or PORT; empty: nobody does
  std::optional<std::string> access;  ///< file that tells workers so; empty: beside the database
};

/// --listen, --access. The target must outlive the parse.
void AddListenFlags(const programs::Command& command, ListenFlags* flags);

/// Takes the port that was asked for, early: who cannot have it leaves no database behind. Empty when none was. Throws
/// bus::BusError, also for an address beyond loopback without a key, unless the network is trusted.
std::optional<bridge::LinkSocket> OpenListener(const ListenFlags& flags, const bus::LcmOptions& network);

/// Carries frames between the socket and the bus from now on, writes the access file, and says both in one line.
std::unique_ptr<bridge::Bridge> Listen(bridge::LinkSocket socket, const bus::LcmOptions& network,
                                       std::int64_t deployment, const std::string& access_file);

}  // namespace legopt::server
