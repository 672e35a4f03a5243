#include "legopt/statistics/hypothesis_tests.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "legopt/statistics/internal/checks.h"

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

namespace {

// Distribution of the sum of those magnitudes whose sign is positive, over all signs: [s] = P(sum = s). Magnitudes of
// signed rank tests are doubled ranks.
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

double NormalTwoSided(double sum, double squares) {
  return std::min(1.0, 2.0 * cdf(complement(boost::math::normal(), std::abs(sum) / std::sqrt(squares))));
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

PermutationTest SignFlip(std::span<const int> differences) {
  constexpr double kMostSteps = 2e8, kMostTotal = 1 << 30;
  PermutationTest test;
  std::vector<int> magnitudes;
  double sum = 0.0, total = 0.0, squares = 0.0;
  for (const int difference : differences) {
    if (difference == 0) continue;
    const double d = difference;
    magnitudes.push_back(std::abs(difference));
    sum += d;
    total += std::abs(d);
    squares += d * d;
  }
  if (total > kMostTotal) Refuse("SignFlip", "differences", "their sum must not be above 2^30", total);
  test.pairs = static_cast<int>(magnitudes.size());
  if (test.pairs == 0) return test;
  test.exact = total * test.pairs <= kMostSteps;
  // The sum is 2 S - total with S the sum over positive signs, whose distribution is symmetric.
  test.p = test.exact ? std::min(1.0, 2.0 * LowerTail(SumDistribution(magnitudes), 0.5 * (total - std::abs(sum))))
                      : NormalTwoSided(sum, squares);
  return test;
}

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

namespace {

// Returns P(X > x) for X ~ chi-square.
double ChiSquareUpperTail(double x, int degrees) { return cdf(complement(boost::math::chi_squared(degrees), x)); }

}  // namespace

std::vector<double> HolmAdjusted(std::span<const double> p) {
  for (const double value : p) {
    if (!(value >= 0.0 && value <= 1.0)) Refuse("HolmAdjusted", "p", "must lie in [0, 1]", value);
  }
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return p[a] < p[b]; });
  std::vector<double> adjusted(p.size());
  double running = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    running = std::max(running, p[order[i]] * static_cast<double>(p.size() - i));
    adjusted[order[i]] = std::min(running, 1.0);
  }
  return adjusted;
}

CochranTest CochranQ(std::span<const std::vector<int>> rows) {
  CochranTest test;
  if (rows.empty()) return test;
  const std::size_t methods = rows[0].size();
  std::vector<double> columns(methods, 0.0);
  double total = 0.0;
  double squares_of_rows = 0.0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const std::string name = "rows[" + std::to_string(i) + "]";
    RequireEqualLengths("CochranQ", name.c_str(), rows[i].size(), methods);
    double solved = 0.0;
    for (std::size_t j = 0; j < methods; ++j) {
      if (rows[i][j] != 0 && rows[i][j] != 1) Refuse("CochranQ", name.c_str(), "must hold zeros and ones", rows[i][j]);
      solved += rows[i][j];
      columns[j] += rows[i][j];
    }
    total += solved;
    squares_of_rows += solved * solved;
    if (solved > 0.0 && solved < static_cast<double>(methods)) ++test.informative;
  }
  test.degrees = std::max(static_cast<int>(methods) - 1, 0);
  if (test.informative == 0) return test;
  const double k = static_cast<double>(methods);
  double squares_of_columns = 0.0;
  for (const double column : columns) squares_of_columns += column * column;
  test.q = (k - 1.0) * (k * squares_of_columns - total * total) / (k * total - squares_of_rows);
  test.p = ChiSquareUpperTail(test.q, test.degrees);
  return test;
}

ImanDavenportTest ImanDavenport(double chi_square, int problems, int methods) {
  RequireCount("ImanDavenport", "problems", problems);
  RequireCount("ImanDavenport", "methods", methods);
  const double n = problems;
  const double most = n * std::max(methods - 1, 0);
  constexpr double kRounding = 1e-9;
  if (!(chi_square >= 0.0 && chi_square <= most * (1.0 + kRounding))) {
    Refuse("ImanDavenport", "chi_square", "must lie between 0 and problems (methods - 1)", chi_square);
  }
  ImanDavenportTest test;
  if (problems < 2 || methods < 2) return test;
  test.numerator = methods - 1;
  test.denominator = (methods - 1) * (problems - 1);
  const double rest = most - chi_square;
  const bool all_agree = rest <= kRounding * most;
  test.f = all_agree ? std::numeric_limits<double>::infinity() : (n - 1.0) * chi_square / rest;
  test.p = all_agree ? 0.0 : cdf(complement(boost::math::fisher_f(test.numerator, test.denominator), test.f));
  return test;
}

FriedmanTest Friedman(std::span<const std::vector<double>> rows) {
  RequireTable("Friedman", rows, {.infinity = true});
  FriedmanTest test;
  test.problems = static_cast<int>(rows.size());
  if (rows.empty()) return test;
  const double n = test.problems;
  const double k = static_cast<double>(rows[0].size());
  test.mean_ranks.assign(rows[0].size(), 0.0);
  double ties = 0.0;
  for (const std::vector<double>& row : rows) {
    const Ranks ranks = MidRanks(row);
    for (std::size_t j = 0; j < row.size(); ++j) test.mean_ranks[j] += ranks.ranks[j];
    ties += ranks.tie_sum;
  }
  // Computed from sums of ranks, which are multiples of 1/2: rounding does not depend on the order of the problems.
  double spread = 0.0;  // n^2 (sum R_j^2 - k (k + 1)^2 / 4)
  for (double& rank : test.mean_ranks) {
    const double above = rank - 0.5 * n * (k + 1.0);
    spread += above * above;
    rank /= n;
  }
  test.degrees = std::max(static_cast<int>(rows[0].size()) - 1, 0);
  if (test.degrees == 0) return test;
  const double correction = n * k * (k * k - 1.0) - ties;  // integer arithmetic: exactly 0 if all are tied
  test.tie_correction = correction / (n * k * (k * k - 1.0));
  test.defined = correction > 0.0;
  if (!test.defined) return test;
  test.chi_square = 12.0 * spread / (n * k * (k + 1.0)) / test.tie_correction;
  test.p = ChiSquareUpperTail(test.chi_square, test.degrees);
  test.iman_davenport = ImanDavenport(test.chi_square, test.problems, static_cast<int>(rows[0].size()));
  return test;
}

}  // namespace legopt::statistics
