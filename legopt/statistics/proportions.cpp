#include "legopt/statistics/proportions.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>

#include "legopt/statistics/checks.h"

namespace legopt::statistics {
namespace {

// Correlation of the successes of two methods, with Newcombe's correction.
double CorrectedPhi(const PairCounts& counts) {
  const double a = counts.both;
  const double b = counts.only_first;
  const double c = counts.only_second;
  const double d = counts.neither;
  const double margins = (a + b) * (c + d) * (a + c) * (b + d);
  if (margins == 0.0) return 0.0;
  double numerator = a * d - b * c;
  if (numerator > 0.0) numerator = std::max(numerator - 0.5 * counts.pairs(), 0.0);
  return numerator / std::sqrt(margins);
}

}  // namespace

Interval WilsonInterval(double successes, int problems, double level) {
  RequireCount("WilsonInterval", "problems", problems);
  RequireLevel("WilsonInterval", level);
  if (!(successes >= 0.0 && successes <= problems)) {
    Refuse("WilsonInterval", "successes", "must lie between 0 and the number of problems", successes);
  }
  if (problems == 0) return {.lower = 0.0, .upper = 1.0};
  const double n = problems;
  const double p = successes / n;
  const double z = quantile(complement(boost::math::normal(), 0.5 * (1.0 - level)));
  const double shrink = 1.0 + z * z / n;
  const double middle = (p + z * z / (2.0 * n)) / shrink;
  const double half_width = z / shrink * std::sqrt(p * (1.0 - p) / n + z * z / (4.0 * n * n));
  // At 0 and n one end is the share itself; avoids rounding errors.
  return {.lower = successes == 0.0 ? 0.0 : std::max(middle - half_width, 0.0),
          .upper = successes == n ? 1.0 : std::min(middle + half_width, 1.0)};
}

ShareDifference PairedShareDifference(const PairCounts& counts, double level) {
  constexpr char kName[] = "PairedShareDifference";
  RequireCount(kName, "both", counts.both);
  RequireCount(kName, "only_first", counts.only_first);
  RequireCount(kName, "only_second", counts.only_second);
  RequireCount(kName, "neither", counts.neither);
  RequireLevel(kName, level);
  const int n = counts.pairs();
  if (n == 0) return {.estimate = 0.0, .interval = {.lower = -1.0, .upper = 1.0}};
  const int solved_by_first = counts.both + counts.only_first;
  const int solved_by_second = counts.both + counts.only_second;
  const double first = static_cast<double>(solved_by_first) / n;
  const double second = static_cast<double>(solved_by_second) / n;
  const Interval of_first = WilsonInterval(solved_by_first, n, level);
  const Interval of_second = WilsonInterval(solved_by_second, n, level);
  const double phi = CorrectedPhi(counts);
  const auto together = [phi](double d1, double d2) {
    return std::sqrt(std::max(d1 * d1 - 2.0 * phi * d1 * d2 + d2 * d2, 0.0));
  };
  const double estimate = static_cast<double>(counts.only_first - counts.only_second) / n;
  const double below = together(first - of_first.lower, of_second.upper - second);
  const double above = together(of_first.upper - first, second - of_second.lower);
  return {.estimate = estimate,
          .interval = {.lower = std::max(estimate - below, -1.0), .upper = std::min(estimate + above, 1.0)}};
}

McNemarTest McNemar(int only_first, int only_second) {
  RequireCount("McNemar", "only_first", only_first);
  RequireCount("McNemar", "only_second", only_second);
  McNemarTest test;
  test.discordant = only_first + only_second;
  if (test.discordant == 0) return test;
  const int fewer = std::min(only_first, only_second);
  const boost::math::binomial fair_coin(test.discordant, 0.5);
  const double point = pdf(fair_coin, fewer);
  test.exact_p = std::min(1.0, 2.0 * cdf(fair_coin, fewer));
  test.mid_p = only_first == only_second ? 1.0 - 0.5 * point : test.exact_p - point;
  return test;
}

}  // namespace legopt::statistics
