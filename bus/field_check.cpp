#include "bus/field_check.h"

#include <algorithm>
#include <cstdint>
#include <limits>
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

void FieldCheck::Fail(std::string_view field, const std::string& value, const std::string& allowed) {
  if (!fault_.empty()) return;
  fault_ = std::string(field) + ": " + value + ": must be " + allowed;
}

FieldCheck& FieldCheck::Range(std::string_view field, std::int64_t value, std::int64_t low, std::int64_t high) {
  if (value < low || value > high) {
    Fail(field, std::to_string(value), "in " + std::to_string(low) + " .. " + std::to_string(high));
  }
  return *this;
}

FieldCheck& FieldCheck::AtLeast(std::string_view field, std::int64_t value, std::int64_t low) {
  if (value < low) Fail(field, std::to_string(value), "at least " + std::to_string(low));
  return *this;
}

FieldCheck& FieldCheck::NonZero(std::string_view field, std::int64_t value) {
  if (value == 0) Fail(field, "0", "non-zero");
  return *this;
}

FieldCheck& FieldCheck::Text(std::string_view field, const std::string& value, std::size_t least_bytes,
                             std::size_t most_bytes) {
  if (value.size() < least_bytes || value.size() > most_bytes) {
    Fail(field, std::to_string(value.size()) + " bytes",
         std::to_string(least_bytes) + " .. " + std::to_string(most_bytes) + " bytes");
  } else if (!IsText(value)) {
    Fail(field, "binary", "UTF-8 without NUL");
  }
  return *this;
}

bool NestsWithin(std::string_view json, int most) {
  int depth = 0;
  bool in_text = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_text) {
      if (c == '\\') ++i;
      if (c == '"') in_text = false;
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > most) return false;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return true;
}

FieldCheck& FieldCheck::Json(std::string_view field, const std::string& value, std::size_t least_bytes,
                             std::size_t most_bytes) {
  Text(field, value, least_bytes, most_bytes);
  if (!NestsWithin(value, kMaxJsonNesting)) {
    Fail(field, "JSON", "nested at most " + std::to_string(kMaxJsonNesting) + " deep");
  }
  return *this;
}

FieldCheck& FieldCheck::Hash(std::string_view field, const std::string& value) {
  constexpr std::size_t kHashDigits = 64;
  const bool hex =
      std::all_of(value.begin(), value.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  if (value.size() != kHashDigits || !hex) {
    Fail(field, CleanText(value, kHashDigits), "64 lower-case hexadecimal digits");
  }
  return *this;
}

FieldCheck& FieldCheck::NanOrFinite(std::string_view field, double value) {
  if (std::isinf(value)) Fail(field, std::to_string(value), "finite, or NaN for not available");
  return *this;
}

FieldCheck& FieldCheck::Finite(std::string_view field, double value) {
  if (!std::isfinite(value)) Fail(field, std::to_string(value), "finite");
  return *this;
}

FieldCheck& FieldCheck::Count(std::string_view field, std::int64_t count, std::size_t array_size, std::int64_t most) {
  Range(field, count, 0, most);
  if (static_cast<std::size_t>(count) != array_size) {
    Fail(field, std::to_string(count), "the size of its array, " + std::to_string(array_size));
  }
  return *this;
}

FieldCheck& FieldCheck::Require(bool holds, std::string_view what) {
  if (!holds && fault_.empty()) fault_ = what;
  return *this;
}

void FieldCheck::NoneOf(std::string_view field, const std::string& value, const std::string& choices) {
  constexpr std::size_t kShown = 64;
  Fail(field, CleanText(value, kShown), choices);
}

void FieldCheck::Nested(std::string_view field, std::size_t index, const std::string& fault) {
  if (fault.empty() || !fault_.empty()) return;
  fault_ = std::string(field) + "[" + std::to_string(index) + "]." + fault;
}

}  // namespace legopt::bus
