#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bus/bridge/bridge.h"
#include "bus/bridge/link.h"
#include "bus/lcm_transport.h"

namespace legopt::bridge {

/// @file
/// Access files: how a worker on another host finds the server. Written by the server, read by `legopt-worker
/// --access`. They contain no key. Each line has a word and a value:
///
///     legopt-access 1
///     deployment 4711
///     address 192.168.1.2:7669
///     address 127.0.0.1:7669

/// Content of an access file.
struct Access {
  std::int64_t deployment = 0;         ///< > 0
  std::vector<LinkAddress> addresses;  ///< addresses at which the server's host can be reached; 1 to 64
};

/// Returns "192.168.1.2:7669, 127.0.0.1:7669", for messages.
std::string ListOf(const std::vector<LinkAddress>& addresses);

/// Writes an access file with mode 0600, replacing an existing file in one step; streams are written directly. Throws
/// bus::BusError (kInvalidOption) if the file cannot be replaced or is a symbolic link.
void WriteAccessFile(const std::string& file, const Access& access);
/// Reads an access file. Throws bus::BusError (kInvalidOption) with the file, the line and the fault.
Access ReadAccessFile(const std::string& file);

// Bus that no other program of the host can receive: a network namespace with only loopback.

/// Moves this process and its future child processes into a new network namespace, in which loopback carries `group`.
/// Without privileges it also creates a user namespace. There, files keep the access rights of their owners, but the
/// owners of other users' files are displayed as unknown. Files whose owner is checked, above all key files, must be
/// read before. Existing sockets stay in the old namespace. Returns the failed step, or an empty text on success; on
/// failure the process stays where it was. Must be called before a second thread starts.
std::string EnterIsolatedNetwork(const std::string& group);

// Connection of a worker or client to its server, with or without an access file.

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
