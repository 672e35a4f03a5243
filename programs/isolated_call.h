#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace legopt {

/// What an isolated call may take.
struct IsolationLimits {
  int cpu_s = 10;                                     ///< CPU time in whole seconds, at least 1
  int wall_s = 120;                                   ///< real time, at least 1; also bounds a call that waits for ever
  std::int64_t memory_bytes = std::int64_t{1} << 30;  ///< growth of the address space beyond that of the caller
};

/// The call ended without an answer; what() says how ("it ended with signal 11 (Segmentation fault)").
class IsolatedCallFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs `body` in a process of its own and returns the bytes that it returned: for readers that untrusted input may
/// crash, corrupt or keep busy for ever. The process is a copy of the caller's with one thread, prints nothing, dumps
/// no core and ends with the caller's thread; nothing of what `body` does is seen here but its answer. Costs about a
/// millisecond.
///
/// `body` must not rely on other threads or on locks that they could hold at the moment of the call. Where the system
/// denies new processes (EPERM, as to the job processes of workers, which are expendable themselves) `body` runs in the
/// calling process, unlimited.
///
/// Throws IsolatedCallFailed: crash, exception in `body`, limit, or no process could be started. Thread-safe. Linux.
std::string CallIsolated(const std::function<std::string()>& body, const IsolationLimits& limits);

}  // namespace legopt
