#pragma once

namespace legopt::statistics {

/// Both ends belong to it; either may be infinite. Unit: that of what it bounds.
struct Interval {
  double lower = 0.0;  ///< not above `upper`
  double upper = 0.0;  ///< not below `lower`
};

}  // namespace legopt::statistics
