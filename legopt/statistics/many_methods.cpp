#include "legopt/statistics/many_methods.h"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>

#include "legopt/statistics/checks.h"
#include "legopt/statistics/ranks.h"

namespace legopt::statistics {
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
