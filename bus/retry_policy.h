#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

/// @file
/// Adapts the interval before a caller's first retry, based on retries that turned out to be unnecessary. Private to
/// bus.
///
/// If datagrams queue for longer than the first interval, every request is repeated although nothing is lost. The
/// repeats keep the queue full, so that a server that could otherwise serve all its callers never catches up. A reply
/// to a finished call shows that a repeat was unnecessary. (Response times are no measure: with losses they include the
/// wait for a repeat, so a delay derived from them would grow without bound.)

namespace legopt::bus {

/// Adaptive interval before the first retry. Thread rule: none.
class RetryPolicy {
 public:
  /// Time of the transport's steady clock.
  using microseconds = std::chrono::microseconds;
  static constexpr microseconds kLeast = std::chrono::milliseconds(50);  ///< initial and minimum value
  static constexpr microseconds kMost = std::chrono::milliseconds(500);  ///< maximum value

  /// Returns the interval before the first repeat of a call: at least `wanted`, at most `longest` (>= wanted).
  microseconds First(microseconds wanted, microseconds longest) const {
    return learnt_ == kLeast ? wanted : std::clamp(learnt_, wanted, longest);
  }
  /// Returns how long a proof may be in flight: at most until the first repeat of a call, including jitter.
  microseconds PendingProof() const { return learnt_ * 3 / 4; }
  /// Records a reply to a finished call, which shows that its repeat was unnecessary. The interval grows only at the
  /// second late reply to the same call: a single one may be chance if some datagrams are lost and some late.
  void RecordNeedlessRetry(std::int64_t call) {
    if (std::exchange(late_, call) == call) learnt_ = std::min(std::max(learnt_, last_took_ * 5 / 4), kMost);
  }
  /// Records that a call ended `took` after its start, by a reply or by its deadline.
  void RecordCallEnd(microseconds took) { last_took_ = took; }
  /// Records that a call was answered without a repeat, `took` after its start.
  void RecordReply(microseconds took) {
    constexpr int kShare = 2;
    RecordCallEnd(took);
    if (2 * took < learnt_) learnt_ = std::max(learnt_ - learnt_ / kShare, kLeast);
  }

 private:
  microseconds learnt_ = kLeast;
  microseconds last_took_{0};
  std::int64_t late_ = 0;  // call of the last late reply
};

}  // namespace legopt::bus
