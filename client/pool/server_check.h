#pragma once

#include <string>

#include "bus/lcm_transport.h"

namespace legopt::client {

/// Knocks at the addresses of an access file as a worker would, for some seconds. Throws ClientError (kUnreachable)
/// naming them and the key file when no server answers under that key, and bus::BusError for a file that cannot be
/// read. Where this host has no multicast, not even to itself, nothing is checked.
void RequireServer(const std::string& access_file, bus::LcmOptions network);

}  // namespace legopt::client
