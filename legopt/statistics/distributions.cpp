#include "legopt/statistics/distributions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "legopt/statistics/checks.h"

namespace legopt::statistics {
namespace {

double NormalDensity(double z) { return std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi); }

// Returns z with upper tail q, 0 < q <= 1/2.
double UpperTailQuantile(double q) {
  const double t = std::sqrt(-2.0 * std::log(q));
  double z = t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                     (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));  // 26.2.23, error at most 5e-4
  constexpr int kSteps = 3;  // each step triples the order of the error: 5e-4, 1e-11, exact
  for (int step = 0; step < kSteps; ++step) {
    const double newton = (NormalUpperTail(z) - q) / NormalDensity(z);
    z += newton / (1.0 - 0.5 * z * newton);
  }
  return z;
}

// Computes the logarithm of the gamma function for x > 0: Stirling's series for x >= 12, the recurrence below. lgamma
// of the C library writes a global variable.
double LogGamma(double x) {
  constexpr double kFromHere = 12.0;
  double product = 1.0;
  for (; x < kFromHere; x += 1.0) product *= x;
  const double s = 1.0 / (x * x);
  const double series =
      (1.0 / 12.0 - s * (1.0 / 360.0 - s * (1.0 / 1260.0 - s * (1.0 / 1680.0 - s * (1.0 / 1188.0))))) / x;
  return (x - 0.5) * std::log(x) - x + 0.5 * std::log(2.0 * std::numbers::pi) + series - std::log(product);
}

// Computes 1 / (1 + d_1 / (1 + d_2 / (1 + ...))) of DLMF 8.17.22 by the modified method of Lentz.
double BetaFraction(double a, double b, double x) {
  constexpr double kTiny = 1e-300;
  constexpr double kEnough = 1e-16;
  constexpr int kMaxTerms = 10'000;
  const auto nonzero = [](double value) { return std::abs(value) < kTiny ? kTiny : value; };
  double numerator = 1.0;
  double denominator = 0.0;
  double value = 1.0;
  for (int term = 1; term <= kMaxTerms; ++term) {
    const int half = term / 2;
    const double m = half;
    const double d = term % 2 == 0 ? m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
                                   : -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
    denominator = 1.0 / nonzero(1.0 + d * denominator);
    numerator = nonzero(1.0 + d / numerator);
    const double change = numerator * denominator;
    value *= change;
    if (std::abs(change - 1.0) < kEnough) break;
  }
  return 1.0 / value;
}

// Computes I_x(a, b) for 0 < x < 1.
double IncompleteBeta(double a, double b, double x) {
  const double log_front =
      a * std::log(x) + b * std::log1p(-x) + LogGamma(a + b) - LogGamma(a) - LogGamma(b);  // x^a (1-x)^b / B(a, b)
  if (x < (a + 1.0) / (a + b + 2.0)) return std::exp(log_front) * BetaFraction(a, b, x) / a;
  return 1.0 - std::exp(log_front) * BetaFraction(b, a, 1.0 - x) / b;
}

}  // namespace

double NormalCdf(double z) { return NormalUpperTail(-z); }

double NormalUpperTail(double z) { return 0.5 * std::erfc(z / std::numbers::sqrt2); }

double NormalQuantile(double p) {
  if (!(p >= 0.0 && p <= 1.0)) Refuse("NormalQuantile", "p", "must lie in [0, 1]", p);
  if (p == 0.5) return 0.0;
  if (p == 0.0) return -kInfinity;
  if (p == 1.0) return kInfinity;
  return p < 0.5 ? -UpperTailQuantile(p) : UpperTailQuantile(1.0 - p);
}

double FairCoinPmf(int k, int n) {
  RequireCount("FairCoinPoint", "n", n);
  if (k < 0 || k > n) Refuse("FairCoinPoint", "k", "must lie in [0, n]", k);
  k = std::min(k, n - k);
  // Computes n over k, halved whenever it exceeds 1, n times in total.
  double point = 1.0;
  int halvings = 0;
  for (int i = 1; i <= k; ++i) {
    point *= static_cast<double>(n - k + i) / i;
    for (; point > 1.0 && halvings < n; ++halvings) point *= 0.5;
  }
  return std::ldexp(point, halvings - n);
}

double FairCoinCdf(int k, int n) {
  const double point = FairCoinPmf(k, n);
  if (k == n) return 1.0;
  if (2 * static_cast<long long>(k) >= n) return 1.0 - FairCoinCdf(n - k - 1, n);
  double sum = 0.0;
  double ratio = 1.0;  // P(X = i) / P(X = k)
  for (int i = k; i >= 0 && ratio > 0.0; --i) {
    sum += ratio;
    ratio *= static_cast<double>(i) / (n - i + 1);
  }
  return point * sum;
}

double ChiSquareUpperTail(double x, int degrees) {
  RequireCount("ChiSquareUpperTail", "degrees", degrees, 1);
  if (!(x >= 0.0)) Refuse("ChiSquareUpperTail", "x", "must not be negative", x);
  if (x == 0.0) return 1.0;
  if (std::isinf(x)) return 0.0;
  const double half = 0.5 * x;
  const bool odd = degrees % 2 == 1;
  double sum = odd ? std::erfc(std::sqrt(half)) : 0.0;
  for (double power = odd ? 0.5 : 0.0; power < 0.5 * (degrees - 1); power += 1.0) {  // up to degrees/2 - 1
    sum += std::exp(power * std::log(half) - half - LogGamma(power + 1.0));
  }
  return std::min(sum, 1.0);
}

double FUpperTail(double f, int numerator, int denominator) {
  RequireCount("FUpperTail", "numerator", numerator, 1);
  RequireCount("FUpperTail", "denominator", denominator, 1);
  if (!(f >= 0.0)) Refuse("FUpperTail", "f", "must not be negative", f);
  const double x = denominator / (denominator + numerator * f);
  if (x >= 1.0) return 1.0;
  if (x <= 0.0) return 0.0;
  return IncompleteBeta(0.5 * denominator, 0.5 * numerator, x);
}

}  // namespace legopt::statistics
