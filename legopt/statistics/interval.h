#pragma once

namespace legopt::statistics {

/// Closed interval; either end may be infinite.
struct Interval {
  double lower = 0.0;
  double upper = 0.0;
};

}  // namespace legopt::statistics
