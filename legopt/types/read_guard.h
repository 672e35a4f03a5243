#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace legopt {

/// Resource limits for reading one file.
struct ReadLimits {
  int cpu_s = 10;                                     ///< CPU time in whole seconds, at least 1
  int wall_s = 120;                                   ///< wall time, at least 1; also stops a read that blocks for ever
  std::int64_t memory_bytes = std::int64_t{1} << 30;  ///< growth of the address space beyond the caller's
};

/// A guarded read ended without an answer; what() gives the reason ("it ended with signal 11 (Segmentation fault)").
class GuardedReadError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Runs a third-party parser (assimp) on a file that may be malformed and may crash the parser, corrupt memory or never
/// return. The guard calls `read` within the limits and returns the bytes that `read` returned; it throws
/// GuardedReadError if there are none. A guard that runs `read` in a separate process protects this process. `read`
/// must have no side effects. A guard must be callable from several threads at a time.
///
/// Every reader takes a guard; objects that load files later (RobotModel, Scene) store it. An empty guard reads in the
/// calling thread without limits, for trusted files. Valid files give the same result either way.
using ReadGuard = std::function<std::string(const std::function<std::string()>& read, const ReadLimits& limits)>;

}  // namespace legopt
