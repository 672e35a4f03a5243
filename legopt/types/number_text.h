#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

/// @file
/// Conversion between numbers and text, independent of the locale, unlike printf, strtod, std::to_string of a double
/// and streams. All code of the programs reads and writes numbers with these functions.

namespace legopt {

/// Parses the whole text as a double, rounded to nearest: "1.5", "-2e-3", "+1", "inf", "nan". Numbers below the range
/// of double give zero, numbers above it infinity. Empty for any other text, including hexadecimal numbers and
/// surrounding blanks.
std::optional<double> ParseNumber(std::string_view text);

/// Parses the whole text as an integer in base `base`. Empty for any other text and for numbers out of range.
template <std::integral Integer>
std::optional<Integer> ParseInteger(std::string_view text, int base = 10) {
  Integer value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, base);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// Returns the shortest text that parses to the same double.
std::string FormatNumber(double value);
/// Formats like printf's "%.Nf" with N = `decimals`.
std::string FormatFixed(double value, int decimals);
/// Formats like printf's "%.Ng" with N = `digits`.
std::string FormatGeneral(double value, int digits = 6);
/// Formats like printf's "%.Ne" with N = `decimals`.
std::string FormatScientific(double value, int decimals);

}  // namespace legopt
