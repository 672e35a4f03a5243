#pragma once

#include <netinet/in.h>

#include <chrono>
#include <string>

#include "bus/bus_error.h"

namespace legopt::bus {

/// @file
/// Interface on which a deployment sends and receives. With TTL 0 it is loopback, independently of the routes. The
/// kernel discards a multicast packet with TTL 0 only on interfaces where this host is a member of the group, so a
/// socket that follows the route would send to the network after a change of the route. Private to bus.

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

// Detects changes of interfaces, addresses and routes. Private to bus.

/// Subscription to the kernel's notices (rtnetlink) for the network namespace in which it was created. Reports no
/// changes if the kernel refuses the subscription. Thread rule: one thread.
class InterfaceWatch {
 public:
  InterfaceWatch();
  ~InterfaceWatch();
  InterfaceWatch(const InterfaceWatch&) = delete;
  InterfaceWatch& operator=(const InterfaceWatch&) = delete;

  int descriptor() const { return fd_; }  ///< readable after a change; -1: no subscription
  /// Returns whether anything has changed since the last call.
  bool TakeChanges() const;

 private:
  int fd_;
};

// Checks with system calls whether a multicast group and port work, before LCM uses them. LCM itself would print to
// stderr and, behind a firewall, block for ten seconds. Private to bus; ProbeMulticastRoute() of lcm_transport.h is
// the public interface.

/// Result of a probe.
struct ProbeResult {
  bool usable = false;                                 ///< the datagram came back
  BusErrorCode code = BusErrorCode::kNetworkUnusable;  ///< reason if not usable
  std::string problem;                                 ///< problem and fix if not usable
  std::string interface;                               ///< interface that carries the group, if known
};

/// Binds `port` (0: any free port), joins the group, sends a datagram with TTL 0 to it and waits at most `patience` for
/// the datagram to arrive. Uses loopback for `ttl` 0, otherwise the interface to which the routes send the group. The
/// datagram is the one of LCM's self-test, so it does not disturb other parties on the port.
ProbeResult ProbeMulticast(const std::string& group, int port, std::chrono::milliseconds patience, int ttl);

}  // namespace legopt::bus
