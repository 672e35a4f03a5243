#pragma once

#include <Eigen/Core>
#include <vector>

namespace legopt {

/// Numbers that begin where a vector of the processor may: else every other one of its loads crosses a line of the
/// cache.
template <typename Real>
using AlignedNumbers = std::vector<Real, Eigen::aligned_allocator<Real>>;
/// What all but factorisations is computed with.
using AlignedDoubles = AlignedNumbers<double>;

}  // namespace legopt
