#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

/// @file
/// Token bucket that limits bursts of small requests to a size that a receiver's buffer holds without loss. Larger
/// bursts must be expected to lose datagrams; paced traffic does not:
/// docs/explanation/reliability.md#what-lcm-and-udp-do. Private to bus.

namespace legopt::bus {

/// Token bucket for small requests.
class Pacer {
 public:
  /// Time of the transport's steady clock.
  using microseconds = std::chrono::microseconds;
  static constexpr int kBurst = 48;             ///< requests sent without waiting
  static constexpr microseconds kInterval{25};  ///< minimum interval after that: 40,000 requests / s

  /// Takes a token for one request. Returns false if the request must wait.
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
  /// Time of the next token after Take() returned false.
  microseconds next() const { return refilled_ + kInterval; }

 private:
  int tokens_ = kBurst;
  microseconds refilled_{0};
};

}  // namespace legopt::bus
