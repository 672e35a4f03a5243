#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace legopt::client {

/// Layout of displayed text; the default is for files and pipes: no wrapping, no colours.
struct TextLayout {
  std::size_t width = 0;  ///< maximum number of columns of a line; 0: no limit
  bool color = false;     ///< allow escapes for emphasis
};

/// Minimum width of layouts, which is used for smaller values: the longest number and some words.
inline constexpr std::size_t kSmallestWidth = 24;
inline constexpr std::size_t kColumnGap = 2;  ///< spaces between columns

/// Meaning of a text. Colours are the terminal's own, which suit its background.
enum class Emphasis {
  kNone,
  kBest,  ///< best value of its column: bold
  kBad,   ///< a failure: red
  kDim    ///< captions and notes: faint
};

/// Returns `text` enclosed in the escapes of `emphasis`, or unchanged without `color`. Compute widths before.
std::string Emphasized(std::string text, Emphasis emphasis, bool color);

/// Returns the number of terminal columns of UTF-8 `text`: two for wide characters, none for combining ones. Invalid
/// bytes count as one column. The text must not contain escapes.
std::size_t DisplayWidth(std::string_view text);

/// Breaks `text` into lines of at most `width` columns: at spaces, else after one of ",;/", else, in a word longer than
/// a line, between any two characters. Returns at least one line; `width` 0: no limit. Spaces at breaks are dropped.
std::vector<std::string> WrapText(std::string_view text, std::size_t width);

/// Returns the lines of WrapText, each with a line end and the emphasis.
std::string Paragraph(std::string_view text, const TextLayout& layout, Emphasis emphasis = Emphasis::kNone);

}  // namespace legopt::client
