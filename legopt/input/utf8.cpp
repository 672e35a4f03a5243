#include "legopt/input/utf8.h"

#include <algorithm>
#include <array>

#include "legopt/input_error.h"

namespace legopt {

Utf8Character FirstCharacter(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text.front());
  if (lead < 0x80) return {lead, 1};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  char32_t code = lead & (0x7FU >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    if ((byte & 0xC0U) != 0x80U) return {};
    code = (code << 6U) | (byte & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kSmallest = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kSmallest[bytes] || surrogate || code > 0x10FFFF) return {};
  return {code, bytes};
}

std::size_t FirstInvalidByte(std::string_view text) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t bytes = FirstCharacter(text.substr(at)).bytes;
    if (bytes == 0) return at;
    at += bytes;
  }
  return std::string_view::npos;
}

void RequireUtf8(std::string_view text, const std::string& source) {
  const std::size_t at = FirstInvalidByte(text);
  if (at == std::string_view::npos) return;
  constexpr std::string_view kDigits = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(text[at]);
  const std::string hexadecimal = {'0', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
  const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  throw InputError({source + ":" + std::to_string(line), "byte " + std::to_string(at), hexadecimal,
                    "the text is not UTF-8", "save it as UTF-8, for example with 'iconv -f latin1 -t utf-8'"});
}

}  // namespace legopt
