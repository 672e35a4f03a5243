#pragma once

#include <string>

/// @file
/// Bus that no other program of the host can receive: a network namespace with only loopback.

namespace legopt::bridge {

/// Moves this process and its future child processes into a new network namespace, in which loopback carries `group`.
/// Without privileges it also creates a user namespace. There, files keep the access rights of their owners, but the
/// owners of other users' files are displayed as unknown. Files whose owner is checked, above all key files, must be
/// read before. Existing sockets stay in the old namespace. Returns the failed step, or an empty text on success; on
/// failure the process stays where it was. Must be called before a second thread starts.
std::string EnterIsolatedNetwork(const std::string& group);

}  // namespace legopt::bridge
