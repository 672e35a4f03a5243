#pragma once

#include <span>
#include <vector>

namespace legopt::statistics {

/// Ranks of values.
struct Ranks {
  std::vector<double> ranks;  ///< 1 for the smallest; equal values share the mean of their places
  double tie_sum = 0.0;       ///< sum of t^3 - t over groups of t equal values; 0: no ties
};

/// Mid-ranks. Values are tied when they are equal as doubles, so a caller who knows how far they can be trusted rounds
/// them before; +infinity ties with itself. Empty: empty. Throws InputError for NaN and -infinity.
Ranks MidRanks(std::span<const double> values);

}  // namespace legopt::statistics
