#include "legopt/statistics/paired_tests.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "legopt/statistics/checks.h"
#include "legopt/statistics/ranks.h"

namespace legopt::statistics {
namespace {

// Distribution of the sum of the doubled ranks with positive sign, over all signs: [s] = P(2 V = s).
std::vector<double> SumDistribution(const std::vector<int>& doubled_ranks) {
  const int total = std::accumulate(doubled_ranks.begin(), doubled_ranks.end(), 0);
  std::vector<double> points(static_cast<std::size_t>(total) + 1, 0.0);
  points[0] = 1.0;
  int reached = 0;
  for (const int rank : doubled_ranks) {
    reached += rank;
    for (int sum = reached; sum >= 0; --sum) {
      const auto at = static_cast<std::size_t>(sum);
      const double with = sum >= rank ? points[at - static_cast<std::size_t>(rank)] : 0.0;
      points[at] = 0.5 * (points[at] + with);
    }
  }
  return points;
}

// Returns P(2 V <= doubled_sum).
double LowerTail(const std::vector<double>& points, double doubled_sum) {
  const auto end = std::min(points.size(), static_cast<std::size_t>(doubled_sum) + 1);
  return std::min(1.0, std::accumulate(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(end), 0.0));
}

void FillExact(const std::vector<double>& ranks, SignedRankTest& test) {
  std::vector<int> doubled;
  doubled.reserve(ranks.size());
  for (const double rank : ranks) doubled.push_back(static_cast<int>(std::lround(2.0 * rank)));
  const std::vector<double> points = SumDistribution(doubled);
  // The distribution is symmetric: the upper tail of one sum is the lower tail of the other.
  test.greater_p = LowerTail(points, 2.0 * test.negative_sum);
  test.less_p = LowerTail(points, 2.0 * test.positive_sum);
}

void FillNormal(const std::vector<double>& ranks, SignedRankTest& test) {
  double squares = 0.0;
  for (const double rank : ranks) squares += rank * rank;
  const double z = 0.5 * (test.positive_sum - test.negative_sum) / (0.5 * std::sqrt(squares));
  test.greater_p = cdf(complement(boost::math::normal(), z));
  test.less_p = cdf(boost::math::normal(), z);
}

// The largest C with P(V < C) <= tail for n ranks without ties, and the probability outside the interval, both sides.
struct WalshOrder {
  long long order = 0;
  double missed = 0.0;
};

WalshOrder ExactWalshOrder(int n, double tail) {
  std::vector<int> ranks(static_cast<std::size_t>(n));
  std::iota(ranks.begin(), ranks.end(), 1);
  const std::vector<double> points = SumDistribution(ranks);
  WalshOrder found;
  double below = 0.0;  // P(V < C)
  for (const double point : points) {
    if (below + point > tail) break;
    below += point;
    ++found.order;
  }
  found.missed = 2.0 * below;
  return found;
}

WalshOrder NormalWalshOrder(int n, double tail) {
  const double count = n;
  const double mean = count * (count + 1.0) / 4.0;
  const double deviation = std::sqrt(count * (count + 1.0) * (2.0 * count + 1.0) / 24.0);
  const boost::math::normal standard;
  const double bound = std::floor(mean + 0.5 + deviation * quantile(standard, tail));
  if (bound < 1.0) return {};
  return {.order = static_cast<long long>(bound),
          .missed = 2.0 * cdf(standard, (bound - 0.5 - mean) / deviation)};  // P(V < C), with continuity correction
}

}  // namespace

SignedRankTest SignedRank(std::span<const double> differences, const SignedRankOptions& options) {
  constexpr int kMaxExactPairs = 1000;
  RequireNumbers("SignedRank", "differences", differences);
  RequireCount("SignedRank", "most_exact_pairs", options.max_exact_pairs);
  if (options.max_exact_pairs > kMaxExactPairs) {
    Refuse("SignedRank", "most_exact_pairs", "must not be above 1000", options.max_exact_pairs);
  }
  SignedRankTest test;
  std::vector<double> magnitudes;
  std::vector<double> signs;
  for (const double difference : differences) {
    if (difference == 0.0) ++test.zeros;
    if (difference == 0.0 && options.zeros == ZeroRule::kDrop) continue;
    magnitudes.push_back(std::abs(difference));
    signs.push_back(difference);
  }
  test.pairs = static_cast<int>(differences.size()) - test.zeros;
  if (test.pairs == 0) return test;
  const std::vector<double> all_ranks = MidRanks(magnitudes).ranks;
  std::vector<double> ranks;  // ranks of the non-zero differences
  for (std::size_t i = 0; i < signs.size(); ++i) {
    if (signs[i] == 0.0) continue;
    ranks.push_back(all_ranks[i]);
    (signs[i] > 0.0 ? test.positive_sum : test.negative_sum) += all_ranks[i];
  }
  test.exact = test.pairs <= options.max_exact_pairs;
  test.exact ? FillExact(ranks, test) : FillNormal(ranks, test);
  test.two_sided_p = std::min(1.0, 2.0 * std::min(test.greater_p, test.less_p));
  return test;
}

Location HodgesLehmann(std::span<const double> differences, double level) {
  constexpr int kMaxExact = 200;
  RequireNumbers("HodgesLehmann", "differences", differences);
  RequireLevel("HodgesLehmann", level);
  if (differences.size() > kMaxHodgesLehmann) {
    Refuse("HodgesLehmann", "differences", "must not be more than 10000", static_cast<double>(differences.size()));
  }
  Location location{.interval = {.lower = -kInfinity, .upper = kInfinity}};
  const int n = static_cast<int>(differences.size());
  if (n == 0) {
    location.estimate = std::numeric_limits<double>::quiet_NaN();
    return location;
  }
  std::vector<double> averages;
  averages.reserve(differences.size() * (differences.size() + 1) / 2);
  for (std::size_t i = 0; i < differences.size(); ++i) {
    for (std::size_t j = i; j < differences.size(); ++j) {
      averages.push_back(0.5 * differences[i] + 0.5 * differences[j]);  // avoids overflow
    }
  }
  const auto select = [&averages](std::size_t index) {
    const auto at = averages.begin() + static_cast<std::ptrdiff_t>(index);
    std::nth_element(averages.begin(), at, averages.end());
    return *at;
  };
  const std::size_t count = averages.size();
  location.estimate = 0.5 * select((count - 1) / 2) + 0.5 * select(count / 2);
  const double tail = 0.5 * (1.0 - level);
  const WalshOrder walsh = n <= kMaxExact ? ExactWalshOrder(n, tail) : NormalWalshOrder(n, tail);
  if (walsh.order == 0) return location;
  const auto order = static_cast<std::size_t>(walsh.order);
  location.interval = {.lower = select(order - 1), .upper = select(count - order)};
  location.coverage = 1.0 - walsh.missed;
  return location;
}

}  // namespace legopt::statistics
