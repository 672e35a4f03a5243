#pragma once

#include <string>

#include "bus/key_role.h"
#include "legopt_msg/control_request.hpp"

namespace legopt::server {

/// Why the holder of a role's key may not have an action of control carried out; empty: the role may. Clients may
/// pause, resume, retry, rename and tag; only operators may hold, release, rank and delete experiments and drain
/// workers, which concerns the work of others. Pure. Source: PROTOCOL.md, section 11.
std::string RefusalOf(bus::KeyRole role, const legopt_msg::control_request& request);

/// For messages whose type alone decides, before the server sees them (bus::MayCall): empty.
template <class Message>
std::string RefusalOf(bus::KeyRole /*role*/, const Message& /*request*/) {
  return {};
}

}  // namespace legopt::server
