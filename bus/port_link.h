#pragma once

#include <lcm/lcm.h>
#include <netinet/in.h>
#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <utility>

#include "bus/lcm_transport.h"

namespace legopt::bus {

/// @file
/// Finds the sockets and pipes that a library opens without exposing them. Private to bus.

/// Device and inode of an open file. An inode, unlike a descriptor's number, is not reused soon after a close, so other
/// threads may open and close files while a library is observed.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Returns the descriptors of this process's open sockets and pipes with their identities. Without /proc, it misses
/// descriptors more than 64 above the lowest free one. Thread-safe.
std::map<int, FileIdentity> OpenSocketsAndPipes();

/// Sockets and pipes that were open at construction. Thread-safe: constant.
class OpenFilesBefore {
 public:
  OpenFilesBefore();
  /// Returns the descriptors of sockets and pipes opened since construction, by any thread.
  std::set<int> OpenedSince() const;

 private:
  std::set<FileIdentity> files_;
};

// One UDP port of LcmTransport. Private to bus.

/// Sends and receives LCM's short-form packets on one port of the group. Uses LCM or, with TTL 0 and without the route
/// that LCM requires, its own socket on loopback. Both send the same packets. Thread rule: one thread.
class PortLink {
 public:
  /// Receives the payload of a packet on this program's channel.
  using Sink = std::function<void(std::span<const std::uint8_t>)>;

  /// Opens the port. Throws BusError: kNoMulticastRoute, kPortUnusable, kNetworkUnusable.
  PortLink(const LcmOptions& options, int udp_port, Sink sink);
  ~PortLink();
  PortLink(const PortLink&) = delete;
  PortLink& operator=(const PortLink&) = delete;

  /// Sends a datagram. Returns false if the system refuses it.
  bool Send(std::span<const std::uint8_t> datagram);
  int wait_descriptor() const { return wait_fd_; }  ///< readable if Handle has something to do
  /// Passes one packet to the sink if it is on this program's channel. Call only if wait_descriptor() is readable.
  void Handle();
  /// Attaches the socket filter (udp_socket.h). The kernel then drops packets for other parties than `self` and,
  /// with TTL 0, packets of other hosts.
  bool AttachFilter(std::int64_t deployment, std::int64_t self);
  /// Joins the group on the interface to which the routes currently send it. For TTL > 0, after changes.
  void FollowRoute();

  std::size_t granted_buffer() const;             ///< receive buffer as reported by SO_RCVBUF, in bytes
  std::uint64_t inode() const { return inode_; }  ///< inode of the receiving socket; 0: not found

 private:
  bool sends_locally() const { return options_.ttl == 0; }
  bool hears_locally() const { return options_.ttl == 0 && !options_.hear_all_hosts; }
  void OpenLcm();
  void OpenLoopbackSocket();
  void BindSendersToLoopback(const OpenFilesBefore& before);
  void Inspect(const OpenFilesBefore& before);
  void MoveMembershipToLoopback();
  void TakeReceiver(int fd);
  void HandleLoopbackSocket();
  static void OnMessage(const lcm_recv_buf_t* message, const char* channel, void* link);

  LcmOptions options_;
  int udp_port_;
  Sink sink_;
  in_addr group_{};
  lcm_t* lcm_ = nullptr;
  int own_fd_ = -1;      // socket used without LCM
  int wait_fd_ = -1;     // LCM's notification pipe, or own_fd_
  int receive_fd_ = -1;  // LCM's receiving socket or own_fd_; -1: not found
  std::uint64_t inode_ = 0;
  std::uint32_t sequence_ = 0;
  int joined_ = 0;                      // interface on which the group was joined
  std::int64_t filtered_since_us_ = 0;  // wall-clock time, as in LCM's time stamps
  std::chrono::steady_clock::time_point settled_at_;
};

}  // namespace legopt::bus
