#pragma once

#include <string>

#include "bus/message_key.h"
#include "legopt_msg/control_request.hpp"

namespace legopt::server {

/// Returns why a key role may not request a control action; empty if it may. Clients may pause, resume, retry, rename
/// and tag experiments. Only operators may stop running jobs (pause now), set priorities, delete experiments and drain
/// workers, because this affects the work of other users. Pure function. Source: PROTOCOL.md, section 11.
std::string RefusalOf(bus::KeyRole role, const legopt_msg::control_request& request);

/// Overload for messages whose permission depends only on their type, which is checked before the server sees them
/// (bus::MayCall): returns an empty string.
template <class Message>
std::string RefusalOf(bus::KeyRole /*role*/, const Message& /*request*/) {
  return {};
}

}  // namespace legopt::server
