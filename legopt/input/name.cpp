#include "legopt/input/name.h"

#include <glib.h>

#include <algorithm>
#include <array>
#include <memory>

#include "legopt/input/utf8.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

struct CodeRange {
  char32_t first, last;
};

// Characters that are invisible despite their Unicode category: joiners, fillers, selectors.
constexpr std::array<CodeRange, 8> kInvisible = {{{0x34F, 0x34F},
                                                  {0x115F, 0x1160},
                                                  {0x17B4, 0x17B5},
                                                  {0x180B, 0x180F},
                                                  {0x2800, 0x2800},
                                                  {0x3164, 0x3164},
                                                  {0xFE00, 0xFE0F},
                                                  {0xFFA0, 0xFFA0}}};
constexpr CodeRange kTagsAndSelectors = {0xE0000, 0xE0FFF};

bool Holds(const CodeRange& range, char32_t code) { return code >= range.first && code <= range.last; }

bool IsInvisible(char32_t code) {
  const auto type = g_unichar_type(code);
  return type == G_UNICODE_FORMAT || Holds(kTagsAndSelectors, code) ||
         std::any_of(kInvisible.begin(), kInvisible.end(),
                     [code](const CodeRange& range) { return Holds(range, code); });
}

std::string CodeName(char32_t code) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  constexpr int kMinDigits = 4;
  std::string digits;
  for (char32_t rest = code; rest > 0 || digits.size() < kMinDigits; rest >>= 4U) {
    digits.insert(digits.begin(), kDigits[rest & 0xFU]);
  }
  return "U+" + digits;
}

std::optional<NameDiagnostic> FindCharacterFault(char32_t code) {
  const auto type = g_unichar_type(code);
  if (type == G_UNICODE_CONTROL || type == G_UNICODE_LINE_SEPARATOR || type == G_UNICODE_PARAGRAPH_SEPARATOR) {
    return NameDiagnostic{"holds the control character " + CodeName(code), "remove it"};
  }
  if (IsInvisible(code)) return NameDiagnostic{"holds the invisible character " + CodeName(code), "remove it"};
  if (type == G_UNICODE_SPACE_SEPARATOR && code != ' ') {
    return NameDiagnostic{"holds the blank " + CodeName(code), "use an ordinary blank"};
  }
  return std::nullopt;
}

}  // namespace

std::string ToNfc(std::string_view text) {
  if (FirstInvalidByte(text) != std::string_view::npos) return std::string(text);
  const std::unique_ptr<char, decltype(&g_free)> composed(
      g_utf8_normalize(text.data(), static_cast<gssize>(text.size()), G_NORMALIZE_NFC), &g_free);
  return composed ? std::string(composed.get()) : std::string(text);
}

std::optional<NameDiagnostic> DiagnoseName(std::string_view name) {
  if (name.empty()) return NameDiagnostic{"is empty", "write a text"};
  if (FirstInvalidByte(name) != std::string_view::npos) return NameDiagnostic{"is not UTF-8", "write it in UTF-8"};
  for (std::string_view rest = name; !rest.empty();) {
    const Utf8Character character = FirstCharacter(rest);
    if (auto fault = FindCharacterFault(character.code)) return fault;
    rest.remove_prefix(character.bytes);
  }
  if (name.front() == ' ' || name.back() == ' ')
    return NameDiagnostic{"begins or ends with a blank", "remove the blank"};
  if (ToNfc(name) != name) {
    return NameDiagnostic{"is not in composed form (Unicode NFC): it would look like another name",
                          "write accented letters as one character each"};
  }
  return std::nullopt;
}

void RequireName(std::string_view name, const std::string& file, const std::string& field) {
  if (const auto fault = DiagnoseName(name)) {
    throw InputError({file, field, std::string(name), fault->message, fault->fix});
  }
}

}  // namespace legopt
