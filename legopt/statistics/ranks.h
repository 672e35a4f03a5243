#pragma once

#include <span>
#include <vector>

namespace legopt::statistics {

/// Ranks of values, with the sum for tie corrections.
struct Ranks {
  std::vector<double> ranks;  ///< 1 for the smallest; equal values share the mean of their ranks
  double tie_sum = 0.0;       ///< sum of t^3 - t over groups of t equal values; 0 without ties
};

/// Computes mid-ranks. Values are tied if they are equal as doubles, so callers should round them to their significant
/// digits; +infinity ties with itself. Throws InputError for NaN and -infinity.
Ranks MidRanks(std::span<const double> values);

}  // namespace legopt::statistics
