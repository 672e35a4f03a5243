#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "legopt/geometry/signed_distance.h"

namespace legopt {

/// Warm starts for pairs of shapes, for queries at similar configurations, such as those of a solver. They speed up
/// queries. Results may differ by rounding, and by the choice among equally near points, so results of callers that
/// keep a memory depend on its history.
///
/// A hash table with open addressing from pair identifiers (proximity_pair.h) to hints. It holds kMaxPairs and is
/// cleared if there are more. Not thread-safe; allocates only on construction.
class WarmStartCache {
 public:
  static constexpr size_t kMaxPairs = 256;  ///< several times the number of pairs in a typical query of solids

  /// Returns the hint of a pair; empty if there is none. Valid until the next call.
  DistanceHint& At(int pair_id) {
    size_t at = Find(pair_id);
    if (slots_[at].pair_id == kFree) {
      if (count_ == kMaxPairs) {
        Clear();
        at = Find(pair_id);
      }
      slots_[at] = {pair_id, {}};
      ++count_;
    }
    return slots_[at].hint;
  }

  /// Removes all hints.
  void Clear() {
    for (Slot& slot : slots_) slot.pair_id = kFree;
    count_ = 0;
  }

  size_t size() const { return count_; }  ///< number of stored pairs

 private:
  static constexpr int kFree = -1;
  struct Slot {
    int pair_id = kFree;
    DistanceHint hint;
  };

  /// Returns the slot of the pair, or a free slot for it.
  size_t Find(int pair_id) const {
    constexpr std::uint32_t kGolden = 2654435769;  // 2^32 / golden ratio: spreads neighbouring pairs
    constexpr int kHigh = 16;
    const size_t mask = slots_.size() - 1;
    size_t at = ((static_cast<std::uint32_t>(pair_id) * kGolden) >> kHigh) & mask;
    while (slots_[at].pair_id != kFree && slots_[at].pair_id != pair_id) at = (at + 1) & mask;
    return at;
  }

  std::vector<Slot> slots_ = std::vector<Slot>(2 * kMaxPairs);  ///< a power of two, at most half of them used
  size_t count_ = 0;
};

}  // namespace legopt
