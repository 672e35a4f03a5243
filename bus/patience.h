#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <utility>

/// @file
/// How long a caller waits before it repeats a request, learnt from repeats that were not needed. Private to bus.
///
/// Where datagrams queue for longer than the first interval, every request is repeated though nothing is lost, and the
/// repeats keep the queue full: a server that could serve all its callers never gets free again. A reply to a call that
/// is over tells that a repeat of it was not needed. (Times of answers do not tell: under loss they contain the wait
/// for a repeat, so that a delay made from them would grow without bound.)

namespace legopt::bus {

/// The delay learnt so far. Thread rule: none.
class Patience {
 public:
  /// Of the transport's steady clock.
  using microseconds = std::chrono::microseconds;
  static constexpr microseconds kLeast = std::chrono::milliseconds(50);  ///< below it nothing is learnt
  static constexpr microseconds kMost = std::chrono::milliseconds(500);  ///< that it grows to

  /// Interval before the first repeat of a call that asks for `wanted`, at most `longest` (>= wanted).
  microseconds First(microseconds wanted, microseconds longest) const {
    return learnt_ == kLeast ? wanted : std::clamp(learnt_, wanted, longest);
  }
  /// How long a proof may be on its way: no longer than until the first repeat of a call, jitter included.
  microseconds ProofOnItsWay() const { return learnt_ * 3 / 4; }
  /// A reply came to a call that is over, so that a repeat of it was not needed. The second of one call tells that
  /// datagrams queue; one may be chance, where some are lost and some late.
  void RepeatedInVain(std::int64_t call) {
    if (std::exchange(late_, call) == call) learnt_ = std::min(std::max(learnt_, last_took_ * 5 / 4), kMost);
  }
  /// A call ended `took` after it was begun, perhaps by its deadline.
  void Ended(microseconds took) { last_took_ = took; }
  /// A call was answered without a repeat, `took` after it was begun.
  void AnsweredAtOnce(microseconds took) {
    constexpr int kShare = 2;
    Ended(took);
    if (2 * took < learnt_) learnt_ = std::max(learnt_ - learnt_ / kShare, kLeast);
  }

 private:
  microseconds learnt_ = kLeast;
  microseconds last_took_{0};
  std::int64_t late_ = 0;  // the call that a late reply was for
};

}  // namespace legopt::bus
