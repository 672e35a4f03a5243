#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "legopt/collision/signed_distance.h"

namespace legopt {

/// Of every pair of shapes that was looked at, where to look first next time: for queries at configurations that follow
/// each other closely, as a solver's do. It changes how long a query takes, and of its result no more than rounding,
/// and which of several equally near points are taken. Whoever keeps one decides with it what results hang on.
///
/// Hints by the identity of the pair (contact.h), in a table with open addressing. It holds kMostPairs, and begins anew
/// when there are more. One thread; allocates when it is made.
class ContactMemory {
 public:
  static constexpr size_t kMostPairs = 256;  ///< some times as many as a query of solids looks at

  /// Of a pair; empty when there was none. Valid until the next call.
  NearestHint& At(int pair_id) {
    size_t at = Find(pair_id);
    if (slots_[at].pair_id == kFree) {
      if (count_ == kMostPairs) {
        Clear();
        at = Find(pair_id);
      }
      slots_[at] = {pair_id, {}};
      ++count_;
    }
    return slots_[at].hint;
  }

  /// Forgets everything.
  void Clear() {
    for (Slot& slot : slots_) slot.pair_id = kFree;
    count_ = 0;
  }

  size_t size() const { return count_; }  ///< pairs that are remembered

 private:
  static constexpr int kFree = -1;
  struct Slot {
    int pair_id = kFree;
    NearestHint hint;
  };

  /// Where the pair is, or is to be put.
  size_t Find(int pair_id) const {
    constexpr std::uint32_t kGolden = 2654435769;  // 2^32 / golden ratio: neighbouring pairs land far from each other
    constexpr int kHigh = 16;
    const size_t mask = slots_.size() - 1;
    size_t at = ((static_cast<std::uint32_t>(pair_id) * kGolden) >> kHigh) & mask;
    while (slots_[at].pair_id != kFree && slots_[at].pair_id != pair_id) at = (at + 1) & mask;
    return at;
  }

  std::vector<Slot> slots_ = std::vector<Slot>(2 * kMostPairs);  ///< a power of two of them, half of them free
  size_t count_ = 0;
};

}  // namespace legopt
