#pragma once

#include <cstdint>
#include <span>

namespace legopt::bus {

/// @file
/// Kernel-side filter of LcmTransport (classic BPF). Private to bus; purpose: see lcm_transport.h.

/// Attaches the filter to a UDP socket and replaces an earlier one. `self` 0 accepts every destination. `only_from` is
/// the index of the loopback interface: packets of other hosts, which neither arrived through it nor were looped back
/// by the kernel, are dropped; 0 accepts all interfaces. Returns false if the kernel refuses.
bool AttachSocketFilter(int socket_fd, std::int64_t deployment, std::int64_t self, int only_from);

// Kernel statistics of lost datagrams. Private to bus. Source: proc(5); Linux only, zero on other systems.

/// Returns the sum of the "drops" column of /proc/net/udp over the sockets with these inodes: filtered, or lost because
/// the buffer was full.
std::uint64_t SocketDrops(std::span<const std::uint64_t> inodes);

/// "RcvbufErrors" in the Udp lines of /proc/net/snmp: datagrams of all sockets in this network namespace that were lost
/// because the receive buffer was full.
std::uint64_t ReceiveBufferErrors();

/// net.core.rmem_max: largest receive buffer that the kernel grants; 0 if unknown.
std::uint64_t LargestReceiveBuffer();

}  // namespace legopt::bus
