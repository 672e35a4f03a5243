#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "bus/transport.h"

namespace legopt::bus {

/// @file
/// Transport over LCM's udpm provider: UDP multicast, control on `port`, bulk on `port + 1`, channel "LEGOPT".
///
/// Reach: with TTL 0 nothing is sent to or received from other hosts. Sending and membership are bound to the loopback
/// interface, independently of the routes, and the socket filter drops packets from other interfaces. With TTL > 0 both
/// follow the route of the group, also when interfaces or routes change.
///
/// The constructor fails within a second, with a BusError that contains the fix, if the group cannot be used (loopback
/// is down; with TTL > 0: no route) or a port cannot be bound. With TTL 0 the group needs no route. LCM requires one,
/// so without it a socket on loopback replaces LCM and sends the same packets. LCM's descriptors are close-on-exec, and
/// its two reader threads block all signals. Never fork without exec while a transport exists.
///
/// Socket filter (Linux, no privilege needed): the kernel delivers only short-form LCM packets of the channel "LEGOPT"
/// that are not addressed to another party. This protects the process from long-form packets, which crash LCM 1.3.1,
/// and from random channel names, which LCM never frees. It also saves a worker the traffic of other workers. If the
/// filter cannot be attached, a deployment with TTL 0 and without a key is refused. The checks of Endpoint do not
/// depend on the filter.
///
/// Thread rule: see Transport. Source: docs/explanation/reliability.md#what-lcm-and-udp-do.

/// Address and key of a deployment.
struct LcmOptions {
  std::string group = "239.255.76.67";          ///< IPv4 multicast address, 224.0.0.0 - 239.255.255.255
  int port = 7667;                              ///< control port, 1024 - 65534; bulk uses port + 1
  int ttl = 0;                                  ///< hops, 0 - 255; 0: only this host, in both directions
  std::size_t receive_buffer_bytes = 4U << 20;  ///< requested per port; see granted_receive_buffer_bytes()
  /// Receive from other hosts even with TTL 0. For a program that only listens and accepts no commands.
  bool hear_all_hosts = false;
  /// Number of the deployment; 0 derives it from group and port, so that all programs with the same address agree.
  std::int64_t deployment = 0;
  /// File with the shared key (message_key.h), read by the constructor of the transport; empty: checksums only.
  std::string key_file;
  /// The key, if key_file has already been read; otherwise null.
  std::shared_ptr<const MessageKey> key;
  /// Permits TTL > 0 without a key: every party that can reach the group is trusted.
  bool trust_network = false;

  /// Returns the defaults, overridden by the environment variables LEGOPT_GROUP, LEGOPT_PORT, LEGOPT_DEPLOYMENT and
  /// LEGOPT_KEY_FILE. Throws BusError (kInvalidOption).
  static LcmOptions FromEnvironment();
  /// Throws BusError (kInvalidOption) with the field and its range.
  void Validate() const;
};

/// LCM over UDP multicast. Filters and errors: see lcm_transport.h.
class LcmTransport final : public Transport {
 public:
  /// Throws BusError: kInvalidOption (also for an invalid key file), kNoMulticastRoute, kPortUnusable,
  /// kNetworkUnusable.
  explicit LcmTransport(const LcmOptions& options);
  ~LcmTransport() override;

  void Send(Port port, std::span<const std::uint8_t> datagram) override;
  void SetReceiver(DatagramReceiver* receiver, EndpointId self) override;
  int Poll(std::span<pollfd> extra, microseconds max_wait) override;
  microseconds now() const override;
  std::int64_t deployment() const override;
  const MessageKey* key() const override;
  /// kernel_drops: UDP receive-buffer overflows of all sockets in this network namespace since construction.
  /// kernel_filtered: per-socket drops from /proc/net/udp: filtered, or lost because the buffer was full.
  TransportCounters counters() const override;

  /// Receive buffer of one port as reported by SO_RCVBUF, in bytes of payload and overhead. Less than twice the
  /// requested size means that net.core.rmem_max limits it; callers warn.
  std::size_t granted_receive_buffer_bytes() const;
  /// Text of a warning if the granted buffer is too small; otherwise empty.
  std::string receive_buffer_warning() const;
  /// Whether the kernel accepted the filter on both ports. Without it all datagrams reach the process.
  bool socket_filter_attached() const;
  /// One line to print at the start of a program without a key, saying who can send it commands; empty with a key.
  std::string missing_key_warning() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Result of ProbeMulticastRoute.
struct MulticastRoute {
  bool usable = false;    ///< the group can be sent to and received from
  std::string interface;  ///< name of the interface that carries the group, e.g. "eth0"
  std::string problem;    ///< problem and the command that fixes it; empty if usable
};

/// Checks, in well under a second and without LCM, whether this host (network namespace) can send to and receive from
/// the group. `ttl` 0 checks loopback, other values the interface of the route. For `legopt service doctor` and the
/// start of programs.
MulticastRoute ProbeMulticastRoute(const std::string& group, int ttl = 0);

/// Returns a port p in 20000 - 32767 such that p and p + 1 are unused, chosen at random with `seed`. Throws BusError
/// (kPortUnusable).
int FindFreePortPair(std::uint64_t seed);

}  // namespace legopt::bus
