#pragma once

#include <string>

/// @file
/// A bus that no other program of the host can hear: a network namespace with nothing but loopback.

namespace legopt::bridge {

/// Moves this process, and those that it starts, into a network namespace of its own, in which loopback carries
/// `group`. Without privileges a user namespace comes with it, in which files keep their owners' rights but those of
/// other owners look like nobody's: what cares for owners, key files above all, has to be read before. Sockets made
/// before stay outside. Returns what refused it, empty when it is done; a process that was refused is where it was. To
/// be called before there is a second thread.
std::string EnterPrivateBus(const std::string& group);

}  // namespace legopt::bridge
