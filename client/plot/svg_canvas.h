#pragma once

#include <initializer_list>

#include "client/plot/canvas.h"

namespace legopt::client {

/// Draws an SVG file on white. Text stays text, in a sans-serif font of the reader.
class SvgCanvas final : public Canvas {
 public:
  /// Size in points; `font_size` is that of most texts.
  SvgCanvas(double width, double height, double font_size);

  void Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) override;
  void Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) override;
  void Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) override;
  void Box(const Rectangle& box, const AreaLook& look) override;
  void Circle(CanvasPoint center, double radius, const AreaLook& look) override;
  void Text(std::string_view text, CanvasPoint at, const TextLook& look) override;
  std::string Finish() override;

 private:
  void Open(const char* element, std::initializer_list<std::pair<const char*, double>> numbers);
  void Close(const std::string& attributes);

  double font_size_;
  std::string text_;
};

}  // namespace legopt::client
