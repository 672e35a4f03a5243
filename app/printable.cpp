#include "app/printable.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>

#include "legopt/input/text.h"

namespace legopt::app {

std::string ShellWord(const std::string& text) {
  if (text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./+,:@%") ==
          std::string::npos &&
      !text.empty()) {
    return text;
  }
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

namespace {

struct Range {
  char32_t first, last;
};

// Non-ASCII control characters, and invisible characters that change how others are displayed.
constexpr std::array<Range, 10> kUnprintable = {{
    {0x80, 0x9F},        // C1 controls
    {0xAD, 0xAD},        // soft hyphen
    {0x61C, 0x61C},      // Arabic letter mark
    {0x200B, 0x200B},    // zero-width space; the following joiners are used by scripts
    {0x200E, 0x200F},    // directional marks
    {0x2028, 0x202E},    // line and paragraph separators, embeddings and overrides
    {0x2060, 0x206F},    // invisible operators, isolates
    {0xFEFF, 0xFEFF},    // byte order mark
    {0xFFF9, 0xFFFB},    // interlinear annotations
    {0xE0000, 0xE0FFF},  // tags and selectors
}};

bool IsPrintable(char32_t code) {
  if (code < 0x80) return code >= 0x20 && code != 0x7F;
  return std::none_of(kUnprintable.begin(), kUnprintable.end(),
                      [code](const Range& range) { return code >= range.first && code <= range.last; });
}

std::string Escaped(char32_t code) {
  if (code == '\n') return "\\n";
  if (code == '\t') return "\\t";
  if (code == '\r') return "\\r";
  std::array<char, 16> text{};
  std::snprintf(text.data(), text.size(), code < 0x80 ? "\\x%02x" : "\\u%04x", static_cast<unsigned>(code));
  return text.data();
}

std::string EscapedByte(char byte) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "\\x%02x", unsigned{static_cast<unsigned char>(byte)});
  return text.data();
}

}  // namespace

std::string Printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Utf8Character character = FirstCharacter(text);
    const std::size_t bytes = std::max<std::size_t>(character.bytes, 1);
    if (character.bytes == 0) {
      out += EscapedByte(text.front());
    } else if (IsPrintable(character.code)) {
      out += text.substr(0, bytes);
    } else {
      out += Escaped(character.code);
    }
    text.remove_prefix(bytes);
  }
  return out;
}

std::string PrintableLines(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string line(text.substr(0, end));
    if (!line.empty() && line.back() == '\r') line.pop_back();
    std::replace(line.begin(), line.end(), '\t', ' ');
    out += Printable(line);
    if (end < text.size()) out += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return out;
}

std::string WithoutControls(std::string_view text) {
  std::string out(text);
  std::replace_if(
      out.begin(), out.end(),
      [](char c) {
        const auto byte = static_cast<unsigned char>(c);
        return (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7F;
      },
      '?');
  return out;
}

std::string PrintableJson(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  const auto escape = [&out](char32_t unit) {
    std::array<char, 8> text{};
    std::snprintf(text.data(), text.size(), "\\u%04x", static_cast<unsigned>(unit & 0xFFFFU));
    out += text.data();
  };
  while (!json.empty()) {
    const Utf8Character character = FirstCharacter(json);
    const std::size_t bytes = std::max<std::size_t>(character.bytes, 1);
    const bool stays = character.bytes == 0 || character.code == '\n' || IsPrintable(character.code);
    if (stays) {
      out += json.substr(0, bytes);
    } else if (character.code < 0x10000) {
      escape(character.code);
    } else {  // needs a surrogate pair
      const char32_t rest = character.code - 0x10000;
      escape(0xD800U + (rest >> 10U));
      escape(0xDC00U + (rest & 0x3FFU));
    }
    json.remove_prefix(bytes);
  }
  return out;
}

}  // namespace legopt::app
