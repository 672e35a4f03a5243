#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

/// @file
/// The one exception of the bus: the network or an option is unusable, or a message that we built ourselves is illegal.
/// What arrives from others never throws; it is counted (counters.h) and refused.

namespace legopt::bus {

/// What kind of fault it is.
enum class BusErrorCode {
  kInvalidOption,     ///< an option or address is malformed or out of range
  kNoMulticastRoute,  ///< no interface carries the group; the message says which command creates a route
  kPortUnusable,      ///< a port cannot be bound: held exclusively by another program, or privileged
  kNetworkUnusable,   ///< any other refusal by the system or by LCM, e.g. its self-test failed
  kInvalidMessage,    ///< Encode() was given a message that its own validation refuses
};

/// "invalid_option", "no_multicast_route", "port_unusable", "network_unusable", "invalid_message".
std::string_view ToString(BusErrorCode code);

/// The one exception of the bus; bus_error.h says when.
class BusError : public std::runtime_error {
 public:
  /// `message` names the field, its value and the fix.
  BusError(BusErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  BusErrorCode code() const { return code_; }  ///< for programs; what() is for people

 private:
  BusErrorCode code_;
};

}  // namespace legopt::bus
