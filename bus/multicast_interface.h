#pragma once

#include <netinet/in.h>

#include <string>

/// @file
/// Interface on which a deployment sends and receives. With TTL 0 it is loopback, independently of the routes. The
/// kernel discards a multicast packet with TTL 0 only on interfaces where this host is a member of the group, so a
/// socket that follows the route would send to the network after a change of the route. Private to bus.

namespace legopt::bus {

/// Index of the loopback interface of this network namespace; 0: none.
int LoopbackIndex();

/// Returns the index of the interface to which the routes send `group`; 0: no route.
int RouteOf(const in_addr& group);

/// Returns whether any route leads to `group`; the same check as in LCM.
bool HasRoute(const in_addr& group);

/// Returns the name of an interface, e.g. "lo" for 1; empty for an unknown index.
std::string InterfaceName(int interface);

/// Sets the interface for a socket's outgoing multicasts. Returns false and sets errno if the kernel refuses.
bool SendThrough(int socket_fd, int interface);

/// Adds a socket to the group on one interface. Returns true also if it is already a member there. Returns false and
/// sets errno if the kernel refuses.
bool JoinGroup(int socket_fd, const in_addr& group, int interface);

/// Removes a socket from the group: on one interface, which may no longer exist, or for 0 on the interface joined
/// first.
void LeaveGroup(int socket_fd, const in_addr& group, int interface);

}  // namespace legopt::bus
