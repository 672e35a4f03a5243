#include "client/report/text_layout.h"

#include <locale.h>
#include <wchar.h>

#include <algorithm>

namespace legopt::client {
namespace {

// Character properties of the C library, independent of the user's locale. nullptr if the system has no such locale.
locale_t Utf8() {
  static const locale_t locale = ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
  return locale;
}

class Utf8Scope {
 public:
  Utf8Scope() : previous_(Utf8() == nullptr ? nullptr : ::uselocale(Utf8())) {}
  ~Utf8Scope() {
    if (previous_ != nullptr) ::uselocale(previous_);
  }
  Utf8Scope(const Utf8Scope&) = delete;
  Utf8Scope& operator=(const Utf8Scope&) = delete;

 private:
  locale_t previous_;
};

struct Character {
  std::size_t bytes = 1;
  std::size_t columns = 1;
};

// Returns the first character of a text that is not empty. Needs a Utf8Scope.
Character FirstCharacter(std::string_view text) {
  wchar_t wide = 0;
  mbstate_t state{};
  const std::size_t bytes = ::mbrtowc(&wide, text.data(), text.size(), &state);
  if (bytes == 0 || bytes > text.size()) return {};  // not UTF-8: byte by byte
  const int columns = ::wcwidth(wide);
  return {bytes, columns < 0 ? 1 : static_cast<std::size_t>(columns)};
}

bool IsAscii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
}

// Returns the size in bytes of the longest prefix of `text` that fits, at least one character.
std::size_t FittingBytes(std::string_view text, std::size_t width) {
  const Utf8Scope utf8;
  std::size_t bytes = 0;
  for (std::size_t columns = 0; bytes < text.size();) {
    const Character next = FirstCharacter(text.substr(bytes));
    columns += next.columns;
    if (columns > width && bytes > 0) break;
    bytes += next.bytes;
  }
  return bytes;
}

// Returns where to break a text of which `bytes` fit: the end of the line and the start of the next line.
std::pair<std::size_t, std::size_t> BreakAt(std::string_view text, std::size_t bytes) {
  const std::size_t space = text.rfind(' ', bytes);
  const std::size_t end = space == std::string_view::npos ? space : text.find_last_not_of(' ', space);
  const bool has_space = end != std::string_view::npos;
  if (!has_space || 2 * end < bytes) {  // the text after the space is longer than half a line
    const std::size_t mark = text.substr(0, bytes).find_last_of(",;/");
    if (mark != std::string_view::npos && (!has_space || mark > end)) return {mark + 1, mark + 1};
  }
  if (!has_space) return {bytes, bytes};
  return {end + 1, std::min(text.find_first_not_of(' ', space), text.size())};
}

}  // namespace

std::string Emphasized(std::string text, Emphasis emphasis, bool color) {
  if (!color || text.empty()) return text;
  const char* const reset = "\033[0m";
  switch (emphasis) {
    case Emphasis::kNone:
      return text;
    case Emphasis::kBest:
      return "\033[1m" + text + reset;
    case Emphasis::kBad:
      return "\033[31m" + text + reset;
    case Emphasis::kDim:
      return "\033[2m" + text + reset;
  }
  return text;
}

std::size_t DisplayWidth(std::string_view text) {
  if (IsAscii(text)) return text.size();
  const Utf8Scope utf8;
  std::size_t columns = 0;
  while (!text.empty()) {
    const Character next = FirstCharacter(text);
    columns += next.columns;
    text.remove_prefix(next.bytes);
  }
  return columns;
}

std::vector<std::string> WrapText(std::string_view text, std::size_t width) {
  std::vector<std::string> lines;
  while (width > 0 && DisplayWidth(text) > width) {
    const auto [end, next] = BreakAt(text, FittingBytes(text, width));
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(next);
  }
  if (!text.empty() || lines.empty()) lines.emplace_back(text);
  return lines;
}

std::string Paragraph(std::string_view text, const TextLayout& layout, Emphasis emphasis) {
  std::string lines;
  for (auto& line : WrapText(text, layout.width)) lines += Emphasized(std::move(line), emphasis, layout.color) + "\n";
  return lines;
}

}  // namespace legopt::client
