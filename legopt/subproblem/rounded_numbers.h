#pragma once

#include <span>
#include <type_traits>

#include "legopt/subproblem/aligned_numbers.h"

namespace legopt {

/// Doubles as Reals: rounded copies, or where these are doubles, those that were given, which must stay where they are
/// while they are read here. One thread; allocates only while it grows.
template <typename Real>
class RoundedNumbers {
 public:
  /// Holds `from` from now on.
  void Set(std::span<const double> from) {
    if constexpr (std::is_same_v<Real, double>) {
      numbers_ = from.data();
    } else {
      if (copy_.size() < from.size()) copy_.resize(from.size());
      for (size_t i = 0; i < from.size(); ++i) copy_[i] = static_cast<Real>(from[i]);
      numbers_ = copy_.data();
    }
  }
  const Real* data() const { return numbers_; }  ///< as many as were given

 private:
  AlignedNumbers<Real> copy_;
  const Real* numbers_ = nullptr;
};

}  // namespace legopt
