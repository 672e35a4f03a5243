#pragma once

#include <Eigen/Core>
#include <span>
#include <type_traits>
#include <vector>

namespace legopt {

/// Numbers that are aligned to the processor's vectors. Without alignment, every second load would cross a cache line.
template <typename Real>
using AlignedNumbers = std::vector<Real, Eigen::aligned_allocator<Real>>;
/// Numbers in all computations except factorisations.
using AlignedDoubles = AlignedNumbers<double>;

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
