#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "legopt/types/byte_cache.h"

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
///
/// A guard may have a cache, in which readers store results computed from a file's content.
class ReadGuard {
 public:
  /// Type of the function that runs `read`.
  using Function = std::function<std::string(const std::function<std::string()>& read, const ReadLimits& limits)>;

  ReadGuard() = default;
  // NOLINTBEGIN(google-explicit-constructor, bugprone-forwarding-reference-overload)
  /// Converts any function of this type, but no guard. `cache` may be null.
  template <class Runner>
  requires std::is_constructible_v<Function, Runner> &&(!std::is_same_v<std::remove_cvref_t<Runner>, ReadGuard>)
      ReadGuard(Runner&& run, std::shared_ptr<const ByteCache> cache = nullptr)
      : run_(std::forward<Runner>(run)), cache_(std::move(cache)) {}
  // NOLINTEND(google-explicit-constructor, bugprone-forwarding-reference-overload)

  explicit operator bool() const { return static_cast<bool>(run_); }  ///< false for an empty guard
  /// Runs `read`. The guard must not be empty.
  std::string operator()(const std::function<std::string()>& read, const ReadLimits& limits) const {
    return run_(read, limits);
  }
  /// Cache of readers; null if there is none.
  const std::shared_ptr<const ByteCache>& cache() const { return cache_; }

 private:
  Function run_;
  std::shared_ptr<const ByteCache> cache_;
};

}  // namespace legopt
