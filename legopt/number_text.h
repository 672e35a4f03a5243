#pragma once

#include <charconv>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

/// @file
/// Numbers as text. The result depends on no locale, unlike printf, strtod, std::to_string of a double and streams; all
/// code of the programs reads and writes numbers by these functions.

namespace legopt {

/// The double that all of `text` names, rounded to nearest: "1.5", "-2e-3", "+1", "inf", "nan". Zero below the range of
/// double, infinite above it. Empty for any other text, also for hexadecimal numbers and surrounding blanks.
std::optional<double> ParseNumber(std::string_view text);

/// The whole number that all of `text` names in base `base`; empty for any other text and for numbers out of range.
template <std::integral Integer>
std::optional<Integer> ParseInteger(std::string_view text, int base = 10) {
  Integer value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value, base);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// Shortest text that reads back as the same double.
std::string FormatNumber(double value);
/// As printf's "%.Nf".
std::string FormatFixed(double value, int decimals);
/// As printf's "%.Ng".
std::string FormatGeneral(double value, int digits = 6);
/// As printf's "%.Ne".
std::string FormatScientific(double value, int decimals);

}  // namespace legopt
