#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "client/plot/canvas.h"

namespace legopt::client {

inline constexpr Color kInk = {0x1c, 0x1c, 0x1c}, kFaint = {0x73, 0x73, 0x73}, kGrid = {0xe0, 0xe0, 0xe0};

/// Returns the colour of a curve, by its index in Plot::entries: of Okabe and Ito (2008), as on the page; the light
/// ones are darkened for lines on white.
Color ColorOf(std::size_t entry);

/// Returns the line of a curve at the scale of a figure. Curves of the same colour have different dashes.
Stroke StrokeOf(std::size_t entry, double scale);

/// Draws the mark of a curve: disc, square, triangle, diamond, then the same shapes hollow.
void DrawMark(std::size_t entry, CanvasPoint at, double scale, double opacity, Canvas* canvas);

/// Estimates the width of a text in a sans-serif font of this size, rather too wide than too narrow.
double WidthOf(std::string_view text, double font_size);

/// Breaks the text at words into lines of at most `width`.
std::vector<std::string> WrappedText(const std::string& text, double width, double font_size);

}  // namespace legopt::client
