#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bridge/passage.h"

/// @file
/// The UDP socket of an end of a link. IPv4, as LCM's group is.

namespace legopt::bridge {

/// "192.168.1.2:7669", or "7669" for all addresses of this host (0.0.0.0). Throws bus::BusError (kInvalidOption).
LinkAddress ParseLinkAddress(std::string_view text);
/// As ParseLinkAddress takes it.
std::string ToString(LinkAddress address);
/// Only programs of this host reach it: 127.0.0.0/8.
bool IsLoopback(LinkAddress address);
/// Under which addresses a socket bound to `bound` is reached: itself, or, bound to 0.0.0.0, one for each interface
/// that is up, loopback last.
std::vector<LinkAddress> ReachableAddresses(LinkAddress bound);

/// Sends and receives datagrams without waiting. It belongs to the network namespace in which it was made, wherever its
/// process goes later. Thread rule: one thread.
class LinkSocket {
 public:
  /// Takes `address`; port 0: any free one. Throws bus::BusError: kPortUnusable when another program has it,
  /// kNetworkUnusable for an address that this host does not have.
  explicit LinkSocket(LinkAddress address);
  ~LinkSocket();
  /// Leaves `other` without a socket, to be destroyed only.
  LinkSocket(LinkSocket&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  LinkSocket(const LinkSocket&) = delete;
  LinkSocket& operator=(const LinkSocket&) = delete;

  int descriptor() const { return fd_; }  ///< to wait on
  LinkAddress address() const;            ///< taken, with the port
  /// Never waits, never reports loss.
  void Send(LinkAddress to, std::span<const std::uint8_t> datagram) const;
  /// The next datagram, cut to `room`, and who sent it; 0 when there is none (or an empty one).
  std::size_t Receive(std::span<std::uint8_t> room, LinkAddress& from) const;

 private:
  int fd_ = -1;
};

}  // namespace legopt::bridge
