#pragma once

#include <functional>
#include <string>

#include "legopt/read_guard.h"

namespace legopt {

/// Runs `body` in a process of its own and returns the bytes that it returned: for readers that untrusted input may
/// crash, corrupt or keep busy for ever. The process is a copy of the caller's with one thread, prints nothing, dumps
/// no core and ends with the caller's thread; nothing of what `body` does is seen here but its answer. Costs about a
/// millisecond.
///
/// `body` must not rely on other threads or on locks that they could hold at the moment of the call. Where the system
/// denies new processes (EPERM, as to the job processes of workers, which are expendable themselves) `body` runs in the
/// calling process, unlimited.
///
/// A ReadGuard, which the three programs give to every reader of the library.
///
/// Throws ReadFailed: crash, exception in `body`, limit. Throws std::system_error when the machine has no descriptor or
/// process left. Thread-safe. Linux.
std::string CallIsolated(const std::function<std::string()>& body, const ReadLimits& limits);

}  // namespace legopt
