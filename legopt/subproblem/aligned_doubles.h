#pragma once

#include <Eigen/Core>
#include <vector>

namespace legopt {

/// Numbers that begin where a vector of the processor may: else every other one of its loads crosses a line of the
/// cache.
using AlignedDoubles = std::vector<double, Eigen::aligned_allocator<double>>;

}  // namespace legopt
