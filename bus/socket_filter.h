#pragma once

#include <cstdint>

/// @file
/// The kernel-side filter of LcmTransport (classic BPF). Private to bus; what it keeps away and why: lcm_transport.h.

namespace legopt::bus {

/// Attaches the filter to a UDP socket, replacing an earlier one. `self` 0 lets every destination pass. With
/// `only_from`, the index of the loopback interface, it drops packets of other hosts: all that neither came in through
/// that interface nor were looped back by the kernel; 0 lets all pass. False when the kernel refuses.
bool AttachSocketFilter(int socket_fd, std::int64_t deployment, std::int64_t self, int only_from);

}  // namespace legopt::bus
