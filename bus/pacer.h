#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

/// @file
/// A token bucket that keeps bursts of small requests below what a receiver's buffer takes without loss. Private to
/// bus. Larger bursts must be assumed lossy, paced traffic is not: docs/reliability.md#what-lcm-and-udp-do.

namespace legopt::bus {

/// A token bucket for small requests.
class Pacer {
 public:
  /// Of the transport's steady clock.
  using microseconds = std::chrono::microseconds;
  static constexpr int kBurst = 48;             ///< sent without waiting
  static constexpr microseconds kInterval{25};  ///< then one per interval: 40,000 / s

  /// Whether one may be sent now; counts it if so.
  bool Take(microseconds now) {
    const auto earned = (now - refilled_) / kInterval;
    if (earned > 0) {
      tokens_ = static_cast<int>(std::min<std::int64_t>(kBurst, tokens_ + earned));
      refilled_ = tokens_ == kBurst ? now : refilled_ + earned * kInterval;
    }
    if (tokens_ == 0) return false;
    --tokens_;
    return true;
  }
  /// When the next one may be sent, after Take() has refused.
  microseconds next() const { return refilled_ + kInterval; }

 private:
  int tokens_ = kBurst;
  microseconds refilled_{0};
};

}  // namespace legopt::bus
