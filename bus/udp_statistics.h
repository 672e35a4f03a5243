#pragma once

#include <cstdint>
#include <span>

/// @file
/// Kernel statistics of lost datagrams. Private to bus. Source: proc(5); Linux only, zero on other systems.

namespace legopt::bus {

/// Returns the sum of the "drops" column of /proc/net/udp over the sockets with these inodes: filtered, or lost because
/// the buffer was full.
std::uint64_t SocketDrops(std::span<const std::uint64_t> inodes);

/// "RcvbufErrors" in the Udp lines of /proc/net/snmp: datagrams of all sockets in this network namespace that were lost
/// because the receive buffer was full.
std::uint64_t ReceiveBufferErrors();

/// net.core.rmem_max: largest receive buffer that the kernel grants; 0 if unknown.
std::uint64_t LargestReceiveBuffer();

}  // namespace legopt::bus
