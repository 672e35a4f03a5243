#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

/// @file
/// The only exception of the bus: the network or an option is unusable, or a message built by this program is invalid.
/// Received data never throws; invalid data is counted (endpoint.h) and rejected.

namespace legopt::bus {

/// Kinds of errors.
enum class BusErrorCode {
  kInvalidOption,     ///< an option or address is malformed or out of range
  kNoMulticastRoute,  ///< no interface carries the group; the message contains the command that creates a route
  kPortUnusable,      ///< a port cannot be bound: held exclusively by another program, or privileged
  kNetworkUnusable,   ///< any other failure of the system or of LCM, e.g. of its self-test
  kInvalidMessage,    ///< Encode() was called with a message that its validation rejects
};

/// "invalid_option", "no_multicast_route", "port_unusable", "network_unusable", "invalid_message".
std::string_view ToString(BusErrorCode code);

/// The only exception of the bus; see bus_error.h.
class BusError : public std::runtime_error {
 public:
  /// `message` contains the field, its value and the fix.
  BusError(BusErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  BusErrorCode code() const { return code_; }

 private:
  BusErrorCode code_;
};

}  // namespace legopt::bus
