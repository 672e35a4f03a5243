#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "bus/transport.h"

/// @file
/// Transport over LCM's udpm provider: UDP multicast, control on `port`, bulk on `port + 1`, channel "LEGOPT".
///
/// Reach: with TTL 0 nothing is sent to other hosts and nothing is heard from them. Sending and membership are bound to
/// the loopback interface, whatever the routes say, and the socket filter drops packets from other interfaces. With a
/// TTL above 0 both follow the route of the group, also when interfaces or routes change.
///
/// Construction fails within a second, with a BusError that names the fix, when the group cannot be used (loopback is
/// down; with a TTL above 0: no route) or a port cannot be bound. With TTL 0 the group needs no route: LCM insists on
/// one, so without it a socket on loopback takes LCM's place, with the same packets. LCM's own descriptors are
/// close-on-exec and its two reader threads block all signals. Never fork without exec while a transport lives.
///
/// Socket filter (Linux, no privilege needed): the kernel hands over only short-form LCM packets of our channel that
/// are not addressed to somebody else. That keeps the long-form packets that crash LCM 1.3.1 and random channel names,
/// which it remembers for ever, away from the process, and spares a worker the traffic of its neighbours. Where the
/// filter cannot be attached a deployment with TTL 0 and without a key is refused; the checks of Endpoint do not rely
/// on the filter.
///
/// Thread rule: as Transport. Source: docs/reliability.md#what-lcm-and-udp-do.

namespace legopt::bus {

/// Where a deployment speaks, and with which key.
struct LcmOptions {
  std::string group = "239.255.76.67";          ///< IPv4 multicast address, 224.0.0.0 - 239.255.255.255
  int port = 7667;                              ///< control; bulk is port + 1. 1024 - 65534
  int ttl = 0;                                  ///< hops, 0 - 255; 0: this host only, both ways
  std::size_t receive_buffer_bytes = 4U << 20;  ///< asked of the kernel, per port; see granted_receive_buffer_bytes()
  /// Hear other hosts also with TTL 0: for a program that listens and takes no commands.
  bool hear_all_hosts = false;
  /// Which deployment; 0 derives it from group and port, so that all programs given the same address agree.
  std::int64_t deployment = 0;
  /// File of the shared key (message_key.h), read when the transport is made; empty: messages carry checksums only.
  std::string key_file;
  /// The key, where key_file has been read before; else null.
  std::shared_ptr<const MessageKey> key;
  /// Without a key a TTL above 0 is refused, unless this says that everybody who can reach the group is trusted.
  bool trust_network = false;

  /// Defaults overridden by LEGOPT_GROUP, LEGOPT_PORT, LEGOPT_DEPLOYMENT and LEGOPT_KEY_FILE of the environment. Throws
  /// BusError (kInvalidOption).
  static LcmOptions FromEnvironment();
  /// Throws BusError (kInvalidOption) naming the field and its range.
  void Validate() const;
};

/// LCM over UDP multicast; lcm_transport.h says what it keeps away and how it fails.
class LcmTransport final : public Transport {
 public:
  /// Throws BusError: kInvalidOption (also for what is wrong with the key file), kNoMulticastRoute, kPortUnusable,
  /// kNetworkUnusable.
  explicit LcmTransport(const LcmOptions& options);
  ~LcmTransport() override;

  void Send(Port port, std::span<const std::uint8_t> datagram) override;
  void SetReceiver(DatagramReceiver* receiver, EndpointId self) override;
  int Poll(std::span<pollfd> extra, microseconds max_wait) override;
  microseconds now() const override;
  std::int64_t deployment() const override;
  const MessageKey* key() const override;
  /// kernel_drops: UDP receive-buffer overflows in this network namespace since construction (all sockets of it);
  /// kernel_filtered: per-socket drops of /proc/net/udp, i.e. kept away by the filter or lost for lack of buffer.
  TransportCounters counters() const override;

  /// Receive buffer of one port as read back from the kernel, in bytes of payload and overhead (what SO_RCVBUF
  /// reports). Less than twice the request means that net.core.rmem_max limits it; callers warn.
  std::size_t granted_receive_buffer_bytes() const;
  /// What a warning should say when the grant is small; empty when it is as asked.
  std::string receive_buffer_warning() const;
  /// Whether the kernel took the filter on both ports; without it all datagrams reach the process.
  bool socket_filter_attached() const;
  /// One line for the start of a program that has no key, saying who can command it; empty with a key.
  std::string missing_key_warning() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Result of ProbeMulticastRoute.
struct MulticastRoute {
  bool usable = false;    ///< the group can be sent to and heard
  std::string interface;  ///< name of the interface that carries the group, e.g. "eth0"
  std::string problem;    ///< empty when usable; else what is wrong and the command that fixes it
};

/// Finds out, in well under a second and without LCM, whether this host (network namespace) can send to and receive
/// from the group. `ttl` 0 asks for loopback, other values for the interface of the route. For `legopt doctor` and
/// start-up.
MulticastRoute ProbeMulticastRoute(const std::string& group, int ttl = 0);

/// A pair of ports (p, p + 1) that nobody uses now, from 20000 - 32767, drawn with `seed`. Throws BusError
/// (kPortUnusable).
int FindFreePortPair(std::uint64_t seed);

}  // namespace legopt::bus
