#pragma once

#include <cairo.h>

#include <memory>

#include "client/plot/canvas.h"

namespace legopt::client {

/// Draws a PDF file of one page by cairo. Texts are in the system's sans-serif font, whose used glyphs are embedded.
/// The file has no date, so equal figures have equal bytes.
class PdfCanvas final : public Canvas {
 public:
  /// Size in points. Throws ClientError (kMachine) if cairo cannot make the page.
  PdfCanvas(double width, double height);

  void Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) override;
  void Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) override;
  void Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) override;
  void Box(const Rectangle& box, const AreaLook& look) override;
  void Circle(CanvasPoint center, double radius, const AreaLook& look) override;
  void Text(std::string_view text, CanvasPoint at, const TextLook& look) override;
  /// Throws as the constructor.
  std::string Finish() override;

 private:
  void Trace(const std::vector<CanvasPoint>& points);
  void StrokePath(const Stroke& stroke, double opacity);
  void PaintPath(const AreaLook& look);
  void RequireSound() const;

  std::string bytes_;  ///< receives the file; must outlive the surface
  std::unique_ptr<cairo_surface_t, void (*)(cairo_surface_t*)> surface_;
  std::unique_ptr<cairo_t, void (*)(cairo_t*)> cairo_;
};

}  // namespace legopt::client
