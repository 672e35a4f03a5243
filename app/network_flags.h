#pragma once

#include <optional>
#include <string>

#include "app/command_line.h"
#include "bus/lcm_transport.h"

namespace legopt::app {

/// Deployment given by the flags of a program. Missing values come from the environment (LEGOPT_GROUP, LEGOPT_PORT,
/// LEGOPT_KEY_FILE) or are the defaults of bus::LcmOptions.
struct NetworkFlags {
  std::optional<std::string> group;
  std::optional<int> port;  ///< control port; bulk uses the next one
  std::optional<int> ttl;   ///< network hops of sent packets; 0: only this machine
  std::optional<std::string> key_file;
  bool trust_network = false;  ///< permit messages to leave this machine without a key

  /// Throws bus::BusError (kInvalidOption), also for an invalid environment variable.
  bus::LcmOptions Resolve() const;
};

/// Adds --group, --port, --key-file, for programs that only listen. The target must outlive parsing.
void AddListeningFlags(const Command& command, NetworkFlags* flags);
/// Adds these flags and --ttl, --trust-network, for programs that send.
void AddNetworkFlags(const Command& command, NetworkFlags* flags);
/// Heading of these flags in the help.
inline constexpr char kNetworkHeading[] = "Network";

}  // namespace legopt::app
