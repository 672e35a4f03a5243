#pragma once

#include <netinet/in.h>

#include <string>

/// @file
/// The interface that a deployment uses, for sending and for receiving. With TTL 0 it is loopback, whatever the routes
/// say: the kernel discards a multicast packet of TTL 0 only on interfaces where this host is a member of the group, so
/// a socket that follows the route would send to the network as soon as the route moves. Private to bus.

namespace legopt::bus {

/// Index of the loopback interface of this network namespace; 0: there is none.
int LoopbackIndex();

/// Index of the interface to which the routes send `group`; 0: there is no route.
int RouteOf(const in_addr& group);

/// Whether any route leads to `group`, as LCM asks it.
bool HasRoute(const in_addr& group);

/// "lo" for 1; empty for an index that no interface has.
std::string InterfaceName(int interface);

/// Sends the multicasts of a socket through one interface. False, with errno, when the kernel refuses.
bool SendThrough(int socket_fd, int interface);

/// Adds a socket to the group on one interface; true also if it is a member there already. False, with errno, when the
/// kernel refuses.
bool JoinGroup(int socket_fd, const in_addr& group, int interface);

/// Removes a socket from the group: on one interface, which may have vanished, or with 0 wherever it joined first.
void LeaveGroup(int socket_fd, const in_addr& group, int interface);

}  // namespace legopt::bus
