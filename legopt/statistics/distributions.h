#pragma once

/// The few distributions that the tests and intervals of this room need, to 12 digits or better. Pure functions, safe
/// to call from any thread. They take exp, log and erfc from the C library, so that another one may differ in the last
/// bit.
namespace legopt::statistics {

/// P(Z <= z) of the standard normal distribution; z may be infinite. NaN: NaN.
double NormalCdf(double z);

/// P(Z > z), exact also far out, where 1 - NormalCdf(z) is rounded away.
double NormalUpperTail(double z);

/// The z with NormalCdf(z) = p, for p in [0, 1]; infinite at its ends. Abramowitz and Stegun 26.2.23, then Halley's
/// steps on the tail. Throws InputError outside [0, 1] and for NaN.
double NormalQuantile(double p);

/// P(X = k) for X ~ Bin(n, 1/2), 0 <= k <= n. Products only, so the same bits everywhere. Throws InputError for others.
double FairCoinPoint(int k, int n);

/// P(X <= k) for X ~ Bin(n, 1/2), 0 <= k <= n. Throws InputError for others.
double FairCoinCdf(int k, int n);

/// P(X > x) for X ~ chi-square of `degrees` >= 1; the finite sums for whole degrees (Abramowitz and Stegun 26.4.4,
/// 26.4.5). x >= 0, may be infinite. Throws InputError for others.
double ChiSquareUpperTail(double x, int degrees);

/// P(X > f) for X ~ F of (numerator, denominator) degrees, each >= 1: the incomplete beta function
/// I_x(denominator/2, numerator/2) at x = denominator / (denominator + numerator f), by its continued fraction (DLMF
/// 8.17.22). f >= 0, may be infinite. Throws InputError for others.
double FUpperTail(double f, int numerator, int denominator);

}  // namespace legopt::statistics
