#pragma once

#include "client/plot/canvas.h"

namespace legopt::client {

/// Draws a picture of LaTeX's package tikz, for \input: texts are in the document's font.
class PgfCanvas final : public Canvas {
 public:
  /// Size in points of 1/72 inch (bp in TeX).
  PgfCanvas(double width, double height);

  void Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) override;
  void Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) override;
  void Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) override;
  void Box(const Rectangle& box, const AreaLook& look) override;
  void Circle(CanvasPoint center, double radius, const AreaLook& look) override;
  void Text(std::string_view text, CanvasPoint at, const TextLook& look) override;
  std::string Finish() override;

 private:
  std::string Place(CanvasPoint point) const;

  double height_;
  std::string text_;
};

}  // namespace legopt::client
