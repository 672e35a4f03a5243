#include "legopt/statistics/ranks.h"

#include <algorithm>
#include <numeric>

#include "legopt/statistics/checks.h"

namespace legopt::statistics {

Ranks MidRanks(std::span<const double> values) {
  RequireNumbers("MidRanks", "values", values, {.infinity = true});
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  Ranks result;
  result.ranks.resize(values.size());
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    while (end < order.size() && values[order[end]] == values[order[begin]]) ++end;
    const double size = static_cast<double>(end - begin);
    const double rank = 0.5 * static_cast<double>(begin + 1 + end);
    for (std::size_t i = begin; i < end; ++i) result.ranks[order[i]] = rank;
    result.tie_sum += size * size * size - size;
  }
  return result;
}

}  // namespace legopt::statistics
