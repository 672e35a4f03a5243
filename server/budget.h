#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>

#include "db/database_file.h"
#include "db/store.h"

namespace legopt::server {

/// Token bucket rate limiter: `burst` events at once, then `per_s` events per second. Has no clock of its own.
///
/// Thread rule: one thread.
class RateLimit {
 public:
  RateLimit(double burst, double per_s) : burst_(burst), per_s_(per_s), left_(burst) {}

  /// Returns whether an event is allowed at this steady time, and counts it if so.
  bool Take(std::chrono::microseconds now) {
    left_ = std::min(burst_, left_ + per_s_ * std::chrono::duration<double>(now - last_).count());
    last_ = now;
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
  }

 private:
  double burst_, per_s_, left_;
  std::chrono::microseconds last_{0};
};

// Sizes that are compared with the scheduler's limits (SchedulerOptions). Thread rule: none, values.

/// Largest share of a disk that is reserved, so that small disks remain usable.
inline constexpr double kMaxReservedShare = 0.05;

/// Returns the bytes of this disk that submissions leave free: `reserve_bytes`, but at most kMaxReservedShare of the
/// disk.
std::int64_t ReserveOf(const db::DiskSpace& disk, std::int64_t reserve_bytes);

/// Returns the memory used by the summary of an experiment, in bytes.
std::size_t SummaryBytes(const db::ExperimentSummary& summary);

}  // namespace legopt::server
