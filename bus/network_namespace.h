#pragma once

#include <string>

/// @file
/// Network namespaces of Linux: a process in its own has no interface but loopback.

namespace legopt::bus {

/// Moves this process, and those that it starts, into a network namespace of its own. Without privileges a user
/// namespace comes with it, in which other users' files appear to belong to user nobody. Sockets made before stay
/// outside. Returns what refused it, empty when it is done. To be called before there is a second thread.
std::string EnterNetworkNamespace();

/// Brings up the loopback interface of this network namespace. Returns what refused it, empty when it is up.
std::string RaiseLoopback();

}  // namespace legopt::bus
