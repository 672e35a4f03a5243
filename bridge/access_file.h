#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bridge/passage.h"

/// @file
/// What a worker elsewhere has to know to find a server: written by the server, read by `legopt-worker --access`. There
/// is no key in it. Lines of a word and a value:
///
///     legopt-access 1
///     deployment 4711
///     address 192.168.1.2:7669
///     address 127.0.0.1:7669

namespace legopt::bridge {

/// The content of an access file.
struct Access {
  std::int64_t deployment = 0;         ///< > 0
  std::vector<LinkAddress> addresses;  ///< under which the server's host is reached; 1 to 64
};

/// "192.168.1.2:7669, 127.0.0.1:7669", for messages.
std::string ListOf(const std::vector<LinkAddress>& addresses);

/// Replaces `file` at once by one of mode 0600; streams are written into. Throws bus::BusError (kInvalidOption): it
/// cannot be replaced, or is a symbolic link.
void WriteAccessFile(const std::string& file, const Access& access);
/// Throws bus::BusError (kInvalidOption) naming the file, the line and the fault.
Access ReadAccessFile(const std::string& file);

}  // namespace legopt::bridge
