// Server side of the bridge: --listen and --access. Source: PROTOCOL.md, section 14.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "app/command_line.h"
#include "bus/bridge/bridge.h"
#include "bus/lcm_transport.h"

namespace legopt::server {

/// Address for hosts that this host's multicast does not reach.
struct ListenFlags {
  std::optional<std::string> listen;  ///< ADDRESS:PORT or PORT; empty: do not listen
  std::optional<std::string> access;  ///< path of the access file for workers; empty: beside the database
};

/// Adds the options --listen and --access. `flags` must outlive parsing.
void AddListenFlags(const app::Command& command, ListenFlags* flags);

/// Binds the requested port; nullopt without --listen. Called before the database is opened, so that a failure leaves
/// no database behind. Throws bus::BusError, also for a non-loopback address without a key, unless the network is
/// trusted.
std::optional<bridge::LinkSocket> OpenListener(const ListenFlags& flags, const bus::LcmOptions& network);

/// Starts to forward frames between the socket and the bus, writes the access file, and prints one line about both.
std::unique_ptr<bridge::Bridge> Listen(bridge::LinkSocket socket, const bus::LcmOptions& network,
                                       std::int64_t deployment, const std::string& access_file);

}  // namespace legopt::server
