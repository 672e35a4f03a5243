#pragma once

#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

namespace legopt {

/// What reading one file may take.
struct ReadLimits {
  int cpu_s = 10;                                     ///< CPU time in whole seconds, at least 1
  int wall_s = 120;                                   ///< real time, at least 1; also bounds a read that waits for ever
  std::int64_t memory_bytes = std::int64_t{1} << 30;  ///< growth of the address space beyond that of the caller
};

/// A guarded read ended without an answer; what() says how ("it ended with signal 11 (Segmentation fault)").
class ReadFailed : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// How the libraries of others (urdfdom, assimp) are run on a file that may be damaged, and may crash them, corrupt
/// memory or keep them busy for ever: the guard calls `read`, which returns bytes, within the limits, and returns those
/// bytes; it throws ReadFailed when there are none. A guard that runs `read` in a process of its own keeps this process
/// whole. `read` touches nothing but its answer. A guard must be callable from any thread, from several at a time.
///
/// Every reader takes one; what names files that are read later (RobotModel, Scene) remembers it. An empty guard reads
/// in the calling thread, without limits: right for files that one trusts. The result for sound files is the same.
using ReadGuard = std::function<std::string(const std::function<std::string()>& read, const ReadLimits& limits)>;

}  // namespace legopt
