#pragma once

#include <cstdint>

/// @file
/// The kernel-side filter of LcmTransport (classic BPF). Private to bus; what it keeps away and why: lcm_transport.h.

namespace legopt::bus {

/// Attaches the filter to a UDP socket, replacing an earlier one. `self` 0 lets every destination pass. False when the
/// kernel refuses.
bool AttachSocketFilter(int socket_fd, std::int64_t deployment, std::int64_t self);

}  // namespace legopt::bus
