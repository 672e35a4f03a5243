#pragma once

#include <cstdint>

/// @file
/// Kernel-side filter of LcmTransport (classic BPF). Private to bus; purpose: see lcm_transport.h.

namespace legopt::bus {

/// Attaches the filter to a UDP socket and replaces an earlier one. `self` 0 accepts every destination. `only_from` is
/// the index of the loopback interface: packets of other hosts, which neither arrived through it nor were looped back
/// by the kernel, are dropped; 0 accepts all interfaces. Returns false if the kernel refuses.
bool AttachSocketFilter(int socket_fd, std::int64_t deployment, std::int64_t self, int only_from);

}  // namespace legopt::bus
