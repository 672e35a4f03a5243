#pragma once

#include <algorithm>
#include <chrono>

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

}  // namespace legopt::server
