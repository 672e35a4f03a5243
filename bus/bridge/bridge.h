#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bus/bridge/link.h"
#include "bus/lcm_transport.h"

namespace legopt::bridge {

/// @file
/// UDP socket of one end of a link. IPv4, like LCM's multicast group.

/// Parses "192.168.1.2:7669", or "7669" for all addresses of this host (0.0.0.0). Throws bus::BusError
/// (kInvalidOption).
LinkAddress ParseLinkAddress(std::string_view text);
/// Returns text that ParseLinkAddress accepts.
std::string ToString(LinkAddress address);
/// Returns whether only programs on this host can reach the address: 127.0.0.0/8.
bool IsLoopback(LinkAddress address);
/// Returns the addresses at which a socket bound to `bound` can be reached: the address itself or, for 0.0.0.0, one for
/// each interface that is up, with loopback last.
std::vector<LinkAddress> ReachableAddresses(LinkAddress bound);

/// Sends and receives datagrams without blocking. Stays in the network namespace in which it was created even if its
/// process changes to another one. Thread rule: one thread.
class LinkSocket {
 public:
  /// Binds to `address`; port 0: any free port. Throws bus::BusError: kPortUnusable if another program uses the port,
  /// kNetworkUnusable if this host does not have the address.
  explicit LinkSocket(LinkAddress address);
  ~LinkSocket();
  /// The moved-from object may only be destroyed.
  LinkSocket(LinkSocket&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  LinkSocket(const LinkSocket&) = delete;
  LinkSocket& operator=(const LinkSocket&) = delete;

  int descriptor() const { return fd_; }  ///< descriptor for poll()
  LinkAddress address() const;            ///< bound address, including the port
  /// Sends a datagram. Never blocks, never reports loss.
  void Send(LinkAddress to, std::span<const std::uint8_t> datagram) const;
  /// Receives the next datagram, truncated to `room`, and its sender. Returns 0 if there is none (or an empty one).
  std::size_t Receive(std::span<std::uint8_t> room, LinkAddress& from) const;

 private:
  int fd_ = -1;
};

/// Running end of a link: a thread that forwards datagrams between LCM on this host and a UDP socket, until this object
/// is destroyed. Its transport receives the datagrams for all parties on the bus.
class Bridge {
 public:
  /// Runs the server's end. Throws bus::BusError.
  static std::unique_ptr<Bridge> RunHub(const bus::LcmOptions& bus, LinkSocket socket);
  /// Runs the end on another host; `hub` are all addresses of the server's end. Throws bus::BusError.
  static std::unique_ptr<Bridge> RunSpoke(const bus::LcmOptions& bus, LinkSocket socket, std::vector<LinkAddress> hub);
  ~Bridge();
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;

  /// Recent counters. Callable from any thread.
  LinkCounters counters() const;
  /// Whether the other end answered recently; always true for a hub. Callable from any thread.
  bool linked() const;

 private:
  class Loop;
  explicit Bridge(std::unique_ptr<Loop> loop);

  std::unique_ptr<Loop> loop_;
};

}  // namespace legopt::bridge
