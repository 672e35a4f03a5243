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
/// Hints by the identity of the pair (contact.h), in a table with open addressing that doubles when it is half full.
/// One thread; no allocation once it has grown.
class ContactMemory {
 public:
  /// Of a pair; empty when there was none. Valid until the next call.
  NearestHint& At(int pair_id) {
    if (2 * (count_ + 1) > slots_.size()) Grow();
    Slot& slot = slots_[Find(pair_id)];
    if (slot.pair_id == kFree) {
      slot = {pair_id, {}};
      ++count_;
    }
    return slot.hint;
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

  void Grow() {
    constexpr size_t kFirst = 64;
    std::vector<Slot> old(slots_.empty() ? kFirst : 2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.pair_id != kFree) slots_[Find(slot.pair_id)] = slot;
    }
  }

  std::vector<Slot> slots_;  ///< a power of two of them
  size_t count_ = 0;
};

}  // namespace legopt
