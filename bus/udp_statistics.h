#pragma once

#include <cstdint>
#include <span>

/// @file
/// What the kernel knows of lost datagrams. Private to bus. Source: proc(5); Linux only, zero elsewhere.

namespace legopt::bus {

/// Sum of the "drops" column of /proc/net/udp over the sockets with these inodes: filtered away or no buffer space.
std::uint64_t SocketDrops(std::span<const std::uint64_t> inodes);

/// "RcvbufErrors" of the Udp lines of /proc/net/snmp: datagrams lost for lack of receive buffer, all sockets of this
/// network namespace.
std::uint64_t ReceiveBufferErrors();

/// net.core.rmem_max: the largest receive buffer that the kernel grants to a request; 0 when unknown.
std::uint64_t LargestReceiveBuffer();

}  // namespace legopt::bus
