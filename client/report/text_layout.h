#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::client {

/// How a text for people is laid out; the default is that of files and pipes: nothing is broken or coloured.
struct TextLayout {
  std::size_t width = 0;  ///< columns that no line exceeds; 0: no limit
  bool color = false;     ///< escapes may emphasise
};

/// The narrowest width that layouts fit into; a smaller one is taken as this: the longest number and some words.
inline constexpr std::size_t kSmallestWidth = 24;
inline constexpr std::size_t kColumnGap = 2;  ///< blanks between columns

/// What a piece of text is to its reader. Colours are the terminal's own, so that they suit its background.
enum class Emphasis {
  kNone,
  kBest,  ///< best of its column: bold
  kBad,   ///< a failure: red
  kDim    ///< captions and notes: faint
};

/// `text` with the escapes of `emphasis` around it, or as it is without `color`. Take widths before.
std::string Emphasized(std::string text, Emphasis emphasis, bool color);

/// Columns that UTF-8 `text` takes on a terminal: two for wide characters, none for combining ones. A byte that is not
/// UTF-8 counts as one. Expects no escapes.
std::size_t DisplayWidth(std::string_view text);

/// Breaks `text` into lines of at most `width` columns: at spaces, else after one of ",;/", else, in a word longer than
/// a line, anywhere between two characters. At least one line; `width` 0: no limit. Spaces at breaks are dropped.
std::vector<std::string> WrapText(std::string_view text, std::size_t width);

/// The lines of WrapText, each with a line end and the emphasis.
std::string Paragraph(std::string_view text, const TextLayout& layout, Emphasis emphasis = Emphasis::kNone);

}  // namespace legopt::client
