#pragma once

#include <Eigen/Core>
#include <vector>

namespace legopt {

/// Numbers that are aligned to the processor's vectors. Without alignment, every second load would cross a cache line.
template <typename Real>
using AlignedNumbers = std::vector<Real, Eigen::aligned_allocator<Real>>;
/// Numbers in all computations except factorisations.
using AlignedDoubles = AlignedNumbers<double>;

}  // namespace legopt
