#include "bus/text.h"

#include <algorithm>
#include <cstdint>
#include <string_view>

namespace legopt::bus {
namespace {

using std::size_t;

// Returns the length of the UTF-8 character at the beginning of `text`; 0 if there is none (RFC 3629: no surrogates, no
// overlong forms).
size_t CharacterBytes(std::string_view text) {
  const auto at = [&](size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const auto tail = [&](size_t i) { return i < text.size() && (at(i) & 0xC0U) == 0x80U; };
  const std::uint8_t first = at(0);
  if (first < 0x80U) return first == 0 ? 0 : 1;
  if (first >= 0xC2U && first <= 0xDFU) return tail(1) ? 2 : 0;
  if (first >= 0xE0U && first <= 0xEFU) {
    if (!tail(1) || !tail(2)) return 0;
    if ((first == 0xE0U && at(1) < 0xA0U) || (first == 0xEDU && at(1) > 0x9FU)) return 0;
    return 3;
  }
  if (first >= 0xF0U && first <= 0xF4U) {
    if (!tail(1) || !tail(2) || !tail(3)) return 0;
    if ((first == 0xF0U && at(1) < 0x90U) || (first == 0xF4U && at(1) > 0x8FU)) return 0;
    return 4;
  }
  return 0;
}

}  // namespace

bool IsText(const std::string& text) {
  for (std::string_view rest = text; !rest.empty();) {
    const size_t length = CharacterBytes(rest);
    if (length == 0) return false;
    rest.remove_prefix(length);
  }
  return true;
}

std::string CleanText(std::string text, size_t limit) {
  if (text.size() <= limit && IsText(text)) return text;
  std::string clean;
  for (std::string_view rest = text; !rest.empty();) {
    const size_t length = CharacterBytes(rest);
    if (clean.size() + std::max<size_t>(length, 1) > limit) break;
    if (length == 0) {
      clean += '?';
      rest.remove_prefix(1);
    } else {
      clean += rest.substr(0, length);
      rest.remove_prefix(length);
    }
  }
  return clean;
}

}  // namespace legopt::bus
