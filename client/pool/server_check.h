#pragma once

#include <string>

#include "bus/lcm_transport.h"

namespace legopt::client {

/// Probes the addresses of an access file for some seconds, like a worker. Throws ClientError (kUnreachable) with the
/// addresses and the key file if no server answers under that key, and bus::BusError if the file cannot be read. Checks
/// nothing if this host has no multicast, not even loopback.
void RequireServer(const std::string& access_file, bus::LcmOptions network);

}  // namespace legopt::client
