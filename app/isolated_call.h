#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "legopt/types/read_guard.h"

namespace legopt {

/// Limits further growth of this process's address space to `extra_bytes` (RLIMIT_AS, soft); 0 or less removes the
/// limit. Beyond it allocations fail as if memory were exhausted. Linux; thread-safe.
void LimitMemoryGrowth(std::int64_t extra_bytes);

/// Runs `body` in a separate process and returns its result. For readers that untrusted input may crash, corrupt or
/// keep busy forever. The process is a copy of the caller's with one thread; it prints nothing, dumps no core and ends
/// with the caller's thread. The caller sees no effect of `body` except the result. Costs about a millisecond.
///
/// `body` must not rely on other threads or on locks that they might hold at the time of the call. If the system denies
/// new processes (EPERM, e.g. for the job processes of workers, which are expendable themselves), `body` runs in the
/// calling process, without limits.
///
/// This is the ReadGuard that the three programs pass to every reader of the library.
///
/// Throws GuardedReadError: crash, exception in `body`, limit. Throws std::system_error if the machine has no
/// descriptor or process left. Thread-safe. Linux.
std::string CallIsolated(const std::function<std::string()>& body, const ReadLimits& limits);

}  // namespace legopt
