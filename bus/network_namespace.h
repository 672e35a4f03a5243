#pragma once

#include <string>

/// @file
/// Linux network namespaces: a process in its own namespace has no interface except loopback.

namespace legopt::bus {

/// Moves this process and its future child processes into a new network namespace. Without privileges it also creates a
/// user namespace, in which other users' files seem to belong to user "nobody". Existing sockets stay in the old
/// namespace. Returns the failed step, or an empty text on success. Must be called before a second thread starts.
std::string EnterNetworkNamespace();

/// Brings up the loopback interface of this network namespace. Returns the failed step, or an empty text on success.
std::string RaiseLoopback();

}  // namespace legopt::bus
