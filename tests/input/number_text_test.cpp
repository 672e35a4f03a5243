// Policy: numbers are read and written as by printf and strtod in the C locale, for every locale of the process.
#include "legopt/types/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace legopt::test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(NumberText, AWholeTextIsOneNumber) {
  EXPECT_EQ(ParseNumber("1.5"), 1.5);
  EXPECT_EQ(ParseNumber("-2e-3"), -2e-3);
  EXPECT_EQ(ParseNumber("+1"), 1.0);
  EXPECT_EQ(ParseNumber(".5"), 0.5);
  EXPECT_EQ(ParseNumber("1."), 1.0);
  EXPECT_EQ(ParseNumber("5e-324"), 5e-324);
  for (const char* text : {"", " 1", "1 ", "1,5", "1.5m", "0x10", "1_000", "+-1", "++1", "-", "+", "e5", "1e"}) {
    EXPECT_FALSE(ParseNumber(text)) << text;
  }
}

TEST(NumberText, OutOfRangeNumbersAreZeroOrInfinite) {
  EXPECT_EQ(ParseNumber("1e400"), kInfinity);
  EXPECT_EQ(ParseNumber("-1e400"), -kInfinity);
  EXPECT_EQ(ParseNumber("1e-400"), 0.0);
  EXPECT_TRUE(std::signbit(*ParseNumber("-1e-400")));
  EXPECT_EQ(ParseNumber("inf"), kInfinity);
  EXPECT_TRUE(std::isnan(*ParseNumber("nan")));
}

TEST(NumberText, WholeNumbersEndAtTheirRange) {
  EXPECT_EQ(ParseInteger<int>("2147483647"), 2147483647);
  EXPECT_FALSE(ParseInteger<int>("2147483648"));
  EXPECT_FALSE(ParseInteger<unsigned>("-1"));
  EXPECT_FALSE(ParseInteger<int>("1.0"));
  EXPECT_FALSE(ParseInteger<int>(""));
  EXPECT_EQ(ParseInteger<std::uint64_t>("ffffffffffffffff", 16), 0xffffffffffffffffU);
}

TEST(NumberText, WrittenAsByPrintf) {
  const double max = std::numeric_limits<double>::max();
  for (const double value : {0.0, -0.0, 0.5, 1.5, 2.5, 0.125, 1.0 / 3.0, 1e-7, 1e7, 123456.5, 999999.5, 1e22, 1e23, max,
                             5e-324, kInfinity, -kInfinity, 0.045, 1.005}) {
    for (const int digits : {0, 1, 2, 4, 6, 10, 17}) {
      char text[512];
      std::snprintf(text, sizeof(text), "%.*f", digits, value);
      EXPECT_EQ(FormatFixed(value, digits), text);
      std::snprintf(text, sizeof(text), "%.*g", digits, value);
      EXPECT_EQ(FormatGeneral(value, digits), text);
      std::snprintf(text, sizeof(text), "%.*e", digits, value);
      EXPECT_EQ(FormatScientific(value, digits), text);
    }
    EXPECT_EQ(ParseNumber(FormatNumber(value)), value);
  }
  EXPECT_EQ(FormatNumber(0.1), "0.1");
}

TEST(ClassicStream, ReadsAndWritesWithAPoint) {
  ClassicOutput out;
  out << 1234567 << ' ' << 0.5;
  EXPECT_EQ(out.str(), "1234567 0.5");
  double value = 0;
  ClassicInput("0.25 x") >> value;
  EXPECT_EQ(value, 0.25);
}

}  // namespace
}  // namespace legopt::test
