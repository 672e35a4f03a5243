#include "bus/bus_error.h"

namespace legopt::bus {

std::string_view ToString(BusErrorCode code) {
  switch (code) {
    case BusErrorCode::kInvalidOption:
      return "invalid_option";
    case BusErrorCode::kNoMulticastRoute:
      return "no_multicast_route";
    case BusErrorCode::kPortUnusable:
      return "port_unusable";
    case BusErrorCode::kNetworkUnusable:
      return "network_unusable";
    case BusErrorCode::kInvalidMessage:
      return "invalid_message";
  }
  return "unknown";
}

}  // namespace legopt::bus
