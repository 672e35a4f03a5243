#pragma once

#include <charconv>
#include <clocale>
#include <concepts>
#include <locale>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>

namespace legopt {

/// @file
/// Conversion between numbers and text, independent of the locale, unlike printf, strtod, std::to_string of a double
/// and streams. All code of the programs reads and writes numbers with these functions.

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

/// A string stream that does not follow the global locale: numbers have a decimal point and no thousands separators.
template <class Stream>
class ClassicStream : public Stream {
 public:
  ClassicStream() { this->imbue(std::locale::classic()); }
  explicit ClassicStream(const std::string& text) : Stream(text) { this->imbue(std::locale::classic()); }
};

using ClassicInput = ClassicStream<std::istringstream>;   ///< input stream over a text
using ClassicOutput = ClassicStream<std::ostringstream>;  ///< output stream to a text

/// Sets the calling thread's locale for numbers to "C" until the end of the scope. Used around third-party libraries
/// that read or write numbers with the C library's locale (tinyxml2, urdfdom, assimp), so that a host program with a
/// decimal comma reads the same datasets. Other threads keep their locale. May be nested.
class ClassicNumericLocale {
 public:
  ClassicNumericLocale() : previous_(::uselocale(Classic())) {}
  ~ClassicNumericLocale() { ::uselocale(previous_); }
  ClassicNumericLocale(const ClassicNumericLocale&) = delete;
  ClassicNumericLocale& operator=(const ClassicNumericLocale&) = delete;

 private:
  static locale_t Classic() {
    static const locale_t kClassic = ::newlocale(LC_ALL_MASK, "C", nullptr);
    return kClassic;
  }

  locale_t previous_;
};

}  // namespace legopt
