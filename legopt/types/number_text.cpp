#include "legopt/types/number_text.h"

#include <array>
#include <clocale>
#include <cstdlib>

namespace legopt {
namespace {

/// strtod of the C locale: from_chars does not report whether a number is above or below the range of double.
double OutOfRangeValue(const std::string& text) {
  static const locale_t kClassic = ::newlocale(LC_ALL_MASK, "C", nullptr);
  return ::strtod_l(text.c_str(), nullptr, kClassic);
}

template <class... Format>
std::string Formatted(double value, Format... format) {
  constexpr std::size_t kMaxCharacters = 512;  // -1.8e308 in full has 310 characters before the decimal point
  std::array<char, kMaxCharacters> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format...);
  return {buffer.data(), result.ptr};
}

}  // namespace

std::optional<double> ParseNumber(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (stop != end || error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) return OutOfRangeValue(std::string(text));
  return value;
}

std::string FormatNumber(double value) { return Formatted(value); }

std::string FormatFixed(double value, int decimals) { return Formatted(value, std::chars_format::fixed, decimals); }

std::string FormatGeneral(double value, int digits) { return Formatted(value, std::chars_format::general, digits); }

std::string FormatScientific(double value, int decimals) {
  return Formatted(value, std::chars_format::scientific, decimals);
}

}  // namespace legopt
