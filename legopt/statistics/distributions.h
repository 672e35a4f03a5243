#pragma once

/// Distributions for the tests and intervals of this module, to 12 digits or better. Pure and thread-safe. They use
/// exp, log and erfc of the C library; with another library the last bit may differ.
namespace legopt::statistics {

/// Returns P(Z <= z) of the standard normal distribution; z may be infinite. NaN: NaN.
double NormalCdf(double z);

/// Returns P(Z > z), also accurate far out, where 1 - NormalCdf(z) loses all digits.
double NormalUpperTail(double z);

/// Returns z with NormalCdf(z) = p, for p in [0, 1]; infinite at both ends. Abramowitz and Stegun 26.2.23, then Halley
/// steps on the tail. Throws InputError for p outside [0, 1] and NaN.
double NormalQuantile(double p);

/// Returns P(X = k) for X ~ Bin(n, 1/2), 0 <= k <= n. Uses products only, so that the bits are the same everywhere.
/// Throws InputError for other k and n.
double FairCoinPmf(int k, int n);

/// Returns P(X <= k) for X ~ Bin(n, 1/2), 0 <= k <= n. Throws InputError for other k and n.
double FairCoinCdf(int k, int n);

/// Returns P(X > x) for X ~ chi-square with `degrees` >= 1 degrees of freedom, by the finite sums of Abramowitz and
/// Stegun 26.4.4 and 26.4.5. x >= 0, may be infinite. Throws InputError for other values.
double ChiSquareUpperTail(double x, int degrees);

/// Returns P(X > f) for X ~ F with (numerator, denominator) degrees of freedom, each >= 1: the incomplete beta function
/// I_x(denominator/2, numerator/2) at x = denominator / (denominator + numerator f), by its continued fraction (DLMF
/// 8.17.22). f >= 0, may be infinite. Throws InputError for other values.
double FUpperTail(double f, int numerator, int denominator);

}  // namespace legopt::statistics
