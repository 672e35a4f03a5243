#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bus/bridge/link_end.h"

/// @file
/// Access files: how a worker on another host finds the server. Written by the server, read by `legopt-worker
/// --access`. They contain no key. Each line has a word and a value:
///
///     legopt-access 1
///     deployment 4711
///     address 192.168.1.2:7669
///     address 127.0.0.1:7669

namespace legopt::bridge {

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

}  // namespace legopt::bridge
