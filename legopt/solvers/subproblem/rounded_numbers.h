#pragma once

#include <span>
#include <type_traits>

#include "legopt/solvers/subproblem/aligned_numbers.h"

namespace legopt {

/// Doubles as Reals: rounded copies or, if Real is double, a view of the given numbers, which must stay in place while
/// it is read. One thread; allocates only while it grows.
template <typename Real>
class RoundedNumbers {
 public:
  /// Sets the numbers to `from`.
  void Set(std::span<const double> from) {
    if constexpr (std::is_same_v<Real, double>) {
      numbers_ = from.data();
    } else {
      if (copy_.size() < from.size()) copy_.resize(from.size());
      for (size_t i = 0; i < from.size(); ++i) copy_[i] = static_cast<Real>(from[i]);
      numbers_ = copy_.data();
    }
  }
  const Real* data() const { return numbers_; }  ///< all numbers of the last Set()

 private:
  AlignedNumbers<Real> copy_;
  const Real* numbers_ = nullptr;
};

}  // namespace legopt
