#include "client/plot/curve_look.h"

#include <array>

#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr std::array<Color, 8> kColors = {{{0x00, 0x72, 0xb2},
                                           {0xd6, 0x5e, 0x00},
                                           {0x00, 0x9e, 0x73},
                                           {0xa8, 0x59, 0x8a},
                                           {0xb8, 0x80, 0x00},
                                           {0x2b, 0x8c, 0xbf},
                                           {0x33, 0x33, 0x33},
                                           {0x8c, 0x52, 0x0a}}};

}  // namespace

Color ColorOf(std::size_t entry) { return kColors[entry % kColors.size()]; }

Stroke StrokeOf(std::size_t entry, double scale) {
  constexpr double kThick = 1.4;
  static const std::array<std::vector<double>, 5> kDashes = {
      {{}, {7.0, 3.0}, {2.0, 2.0}, {9.0, 3.0, 2.0, 3.0}, {5.0, 2.0, 1.0, 2.0, 1.0, 2.0}}};
  Stroke stroke{ColorOf(entry), kThick * scale, kDashes.at((entry + entry / kColors.size()) % kDashes.size())};
  for (double& length : stroke.dash) length *= scale;
  return stroke;
}

void DrawMark(std::size_t entry, CanvasPoint at, double scale, double opacity, Canvas* canvas) {
  constexpr std::size_t kShapes = 4;
  constexpr double kMark = 3.0;
  const double r = kMark * scale;
  const auto [x, y] = at;
  AreaLook look{ColorOf(entry), {}, opacity};
  if (entry / kShapes % 2 == 1) look = {{}, Stroke{ColorOf(entry), scale}, opacity};
  switch (entry % kShapes) {
    case 0:
      return canvas->Circle(at, r, look);
    case 1:
      return canvas->Box({x - r, y - r, 2.0 * r, 2.0 * r}, look);
    case 2:
      return canvas->Polygon({{x, y - r}, {x + r, y + r}, {x - r, y + r}}, look);
    default:
      return canvas->Polygon({{x, y - r}, {x + r, y}, {x, y + r}, {x - r, y}}, look);
  }
}

double WidthOf(std::string_view text, double font_size) {
  constexpr double kNarrow = 0.36, kUsual = 0.58, kWide = 0.9;
  double width = 0.0;
  for (const char c : text) {
    const bool continues = (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;  // a UTF-8 character
    if (continues) continue;
    const bool narrow = std::string_view(" .,:;'|!()[]/-fijlrtI").find(c) != std::string_view::npos;
    const bool wide = std::string_view("mwMW%@").find(c) != std::string_view::npos;
    width += narrow ? kNarrow : wide ? kWide : kUsual;
  }
  return width * font_size;
}

std::vector<std::string> WrappedText(const std::string& text, double width, double font_size) {
  std::vector<std::string> lines;
  ClassicInput words(text);
  for (std::string word; words >> word;) {
    if (lines.empty() || WidthOf(lines.back() + " " + word, font_size) > width) {
      lines.push_back(word);
    } else {
      lines.back() += " " + word;
    }
  }
  return lines;
}

}  // namespace legopt::client
