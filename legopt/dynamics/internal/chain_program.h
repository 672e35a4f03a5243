#pragma once

#include <vector>

#include "legopt/dynamics/path_limits.h"

namespace legopt {

/// Minimises the duration of a time law (time_law.h) over x_1 .. x_N-1, with x_0 = x_N = 0. `x`: N + 1 numbers, a
/// feasible start; replaced by the optimum, which satisfies the constraints up to 1e-9 of their scale. Returns false if
/// the search did not converge; `x` is then undefined.
bool MinimizeDuration(const PathLimits& path, std::vector<double>* x);

}  // namespace legopt
