#pragma once

#include <cstdint>

namespace legopt {

/// Lets the address space of this process grow by no more than `extra_bytes` from now on (RLIMIT_AS, soft); 0 or less
/// lifts the limit. What is taken then fails as if memory were exhausted. Linux; thread-safe.
void LimitMemoryGrowth(std::int64_t extra_bytes);

}  // namespace legopt
