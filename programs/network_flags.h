#pragma once

#include <optional>
#include <string>

#include "bus/lcm_transport.h"
#include "programs/command_line.h"

namespace legopt::programs {

/// The deployment as the flags of a program name it. What they leave out comes from the environment (LEGOPT_GROUP,
/// LEGOPT_PORT, LEGOPT_KEY_FILE), else it is the default of bus::LcmOptions.
struct NetworkFlags {
  std::optional<std::string> group;
  std::optional<int> port;  ///< of control; bulk data takes the next one
  std::optional<int> ttl;   ///< network hops of what we send; 0: stays on this machine
  std::optional<std::string> key_file;
  bool trust_network = false;  ///< let messages leave this machine without a key

  /// Throws bus::BusError (kInvalidOption), for a wrong variable of the environment, too.
  bus::LcmOptions Resolve() const;
};

/// --group, --port, --key-file: for who only listens. The target must outlive the parse.
void AddListeningFlags(const Command& command, NetworkFlags* flags);
/// Those, and --ttl, --trust-network: for who sends.
void AddNetworkFlags(const Command& command, NetworkFlags* flags);
/// Under this heading the help lists them.
inline constexpr char kNetworkHeading[] = "Network";

}  // namespace legopt::programs
