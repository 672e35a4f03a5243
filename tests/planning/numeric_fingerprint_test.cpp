// Elementary functions with the same bits on every machine, and the fingerprint that detects machines which differ.

#include "legopt/planning/internal/numeric_fingerprint.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace legopt {
namespace {

struct Function {
  const char* name;
  double (*function)(double);
  long double (*reference)(long double);
  double from, to;
};

const Function kFunctions[] = {
    {"sin", std::sin, std::sin, -20, 20},          {"cos", std::cos, std::cos, -20, 20},
    {"tan", std::tan, std::tan, -20, 20},          {"asin", std::asin, std::asin, -1, 1},
    {"acos", std::acos, std::acos, -1, 1},         {"atan", std::atan, std::atan, -50, 50},
    {"sinh", std::sinh, std::sinh, -20, 20},       {"cosh", std::cosh, std::cosh, -20, 20},
    {"tanh", std::tanh, std::tanh, -20, 20},       {"asinh", std::asinh, std::asinh, -50, 50},
    {"acosh", std::acosh, std::acosh, 1, 50},      {"atanh", std::atanh, std::atanh, -1, 1},
    {"exp", std::exp, std::exp, -300, 300},        {"exp2", std::exp2, std::exp2, -300, 300},
    {"expm1", std::expm1, std::expm1, -2, 2},      {"log", std::log, std::log, 1e-9, 100},
    {"log2", std::log2, std::log2, 1e-9, 100},     {"log10", std::log10, std::log10, 1e-9, 100},
    {"log1p", std::log1p, std::log1p, -0.99, 100}, {"cbrt", std::cbrt, std::cbrt, -100, 100},
};

double UlpsApart(double value, long double exact) {
  const double next = std::nextafter(std::abs(static_cast<double>(exact)), std::numeric_limits<double>::infinity());
  const long double ulp = next - std::abs(static_cast<double>(exact));
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact) / ulp);
}

TEST(PinnedFunctions, AreWithinAUlp) {
  constexpr int kDraws = 20000;
  constexpr double kUlps = 1.0 + 1e-3;  // the references are rounded as well
  std::mt19937_64 generator(1);
  for (const Function& f : kFunctions) {
    std::uniform_real_distribution<double> draw(f.from, f.to);
    double worst = 0.0;
    for (int i = 0; i < kDraws; ++i) {
      const double x = draw(generator);
      worst = std::max(worst, UlpsApart(f.function(x), f.reference(x)));
    }
    EXPECT_LE(worst, kUlps) << f.name;
  }
}

TEST(PinnedFunctions, OfTwoArgumentsAreWithinAUlp) {
  constexpr int kDraws = 20000;
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> draw(-9, 9), positive(1e-3, 9);
  for (int i = 0; i < kDraws; ++i) {
    const double x = draw(generator), y = draw(generator), p = positive(generator);
    const long double lx = x, ly = y, lp = p;
    ASSERT_LE(UlpsApart(std::atan2(x, y), std::atan2(lx, ly)), 1.001) << x << ' ' << y;
    ASSERT_LE(UlpsApart(std::pow(p, x), std::pow(lp, lx)), 1.001) << p << ' ' << x;
    ASSERT_LE(UlpsApart(std::hypot(x, y), std::hypot(lx, ly)), 1.001) << x << ' ' << y;
  }
}

// Their last bits need not equal those of sin and cos: a compiler may call either, and a build uses one compiler.
TEST(PinnedFunctions, BothAnglesAtOnceAreWithinAUlp) {
  for (double x = -10; x < 10; x += 0.013) {
    double sine = 0, cosine = 0;
    sincos(x, &sine, &cosine);
    const long double exact = x;
    ASSERT_LE(UlpsApart(sine, std::sin(exact)), 1.001) << x;
    ASSERT_LE(UlpsApart(cosine, std::cos(exact)), 1.001) << x;
  }
}

TEST(PinnedFunctions, EdgesAreThoseOfTheStandard) {
  const double infinity = std::numeric_limits<double>::infinity();
  volatile double zero = 0.0, one = 1.0, minus = -1.0;
  EXPECT_EQ(std::exp(-infinity * one), 0.0);
  EXPECT_EQ(std::exp(zero), 1.0);
  EXPECT_EQ(std::log(zero), -infinity);
  EXPECT_TRUE(std::isnan(std::log(minus)));
  EXPECT_EQ(std::log1p(minus), -infinity);
  EXPECT_TRUE(std::signbit(std::sin(-zero)));
  EXPECT_TRUE(std::isnan(std::cos(infinity * one)));
  EXPECT_EQ(std::atan2(zero, minus), M_PI);
  EXPECT_EQ(std::atan2(zero, one), 0.0);
  EXPECT_EQ(std::acos(one), 0.0);
  EXPECT_TRUE(std::isnan(std::acos(2.0 * one)));
  EXPECT_EQ(std::pow(zero, zero), 1.0);
  EXPECT_EQ(std::pow(minus, 3.0 * one), -1.0);
  EXPECT_EQ(std::hypot(infinity * one, zero), infinity);
  EXPECT_EQ(std::tanh(infinity * one), 1.0);
}

TEST(NumericFingerprint, IsSixteenDigitsAndStays) {
  const std::string first = NumericFingerprint();
  EXPECT_THAT(first, testing::MatchesRegex("[0-9a-f]{16}"));
  EXPECT_EQ(NumericFingerprint(), first);
}

}  // namespace
}  // namespace legopt
