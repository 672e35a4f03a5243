#pragma once

#include <cstdint>

namespace legopt {

/// Limits further growth of this process's address space to `extra_bytes` (RLIMIT_AS, soft); 0 or less removes the
/// limit. Beyond it allocations fail as if memory were exhausted. Linux; thread-safe.
void LimitMemoryGrowth(std::int64_t extra_bytes);

}  // namespace legopt
