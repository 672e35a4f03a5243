#include "client/plot/pdf_canvas.h"

#include <cairo-pdf.h>

#include <numbers>

#include "client/client_error.h"

namespace legopt::client {
namespace {

constexpr double kFull = 255.0;

cairo_status_t Append(void* bytes, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

void SetColor(cairo_t* cairo, const Color& color, double opacity) {
  cairo_set_source_rgba(cairo, color.red / kFull, color.green / kFull, color.blue / kFull, opacity);
}

}  // namespace

PdfCanvas::PdfCanvas(double width, double height)
    : surface_(cairo_pdf_surface_create_for_stream(Append, &bytes_, width, height), cairo_surface_destroy),
      cairo_(cairo_create(surface_.get()), cairo_destroy) {
  cairo_pdf_surface_set_metadata(surface_.get(), CAIRO_PDF_METADATA_CREATE_DATE, "");
  cairo_select_font_face(cairo_.get(), "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  RequireSound();
}

void PdfCanvas::Trace(const std::vector<CanvasPoint>& points) {
  cairo_new_path(cairo_.get());
  for (const auto& [x, y] : points) cairo_line_to(cairo_.get(), x, y);
}

void PdfCanvas::StrokePath(const Stroke& stroke, double opacity) {
  SetColor(cairo_.get(), stroke.color, opacity);
  cairo_set_line_width(cairo_.get(), stroke.width);
  cairo_set_dash(cairo_.get(), stroke.dash.data(), static_cast<int>(stroke.dash.size()), 0.0);
  cairo_stroke(cairo_.get());
}

void PdfCanvas::PaintPath(const AreaLook& look) {
  if (look.fill) {
    SetColor(cairo_.get(), *look.fill, look.opacity);
    cairo_fill_preserve(cairo_.get());
  }
  if (look.outline) StrokePath(*look.outline, look.opacity);
  cairo_new_path(cairo_.get());
}

void PdfCanvas::Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) { Polyline({from, to}, stroke); }

void PdfCanvas::Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) {
  Trace(points);
  StrokePath(stroke, 1.0);
}

void PdfCanvas::Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) {
  Trace(corners);
  cairo_close_path(cairo_.get());
  PaintPath(look);
}

void PdfCanvas::Box(const Rectangle& box, const AreaLook& look) {
  cairo_new_path(cairo_.get());
  cairo_rectangle(cairo_.get(), box.left, box.top, box.width, box.height);
  PaintPath(look);
}

void PdfCanvas::Circle(CanvasPoint center, double radius, const AreaLook& look) {
  cairo_new_path(cairo_.get());
  cairo_arc(cairo_.get(), center.first, center.second, radius, 0.0, 2.0 * std::numbers::pi);
  PaintPath(look);
}

void PdfCanvas::Text(std::string_view text, CanvasPoint at, const TextLook& look) {
  const std::string terminated(text);
  cairo_set_font_size(cairo_.get(), look.size);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo_.get(), terminated.c_str(), &extents);
  constexpr double kHalf = 0.5;
  const double before = look.align == Align::kStart    ? 0.0
                        : look.align == Align::kMiddle ? kHalf * extents.x_advance
                                                       : extents.x_advance;
  cairo_save(cairo_.get());
  cairo_translate(cairo_.get(), at.first, at.second);
  if (look.upwards) cairo_rotate(cairo_.get(), -kHalf * std::numbers::pi);
  cairo_move_to(cairo_.get(), -before, 0.0);
  SetColor(cairo_.get(), look.color, 1.0);
  cairo_show_text(cairo_.get(), terminated.c_str());
  cairo_restore(cairo_.get());
}

std::string PdfCanvas::Finish() {
  cairo_show_page(cairo_.get());
  RequireSound();
  cairo_surface_finish(surface_.get());
  RequireSound();
  return std::move(bytes_);
}

void PdfCanvas::RequireSound() const {
  cairo_status_t status = cairo_status(cairo_.get());
  if (status == CAIRO_STATUS_SUCCESS) status = cairo_surface_status(surface_.get());
  if (status == CAIRO_STATUS_SUCCESS) return;
  throw ClientError(ExitCode::kMachine, std::string("the PDF file cannot be made: ") + cairo_status_to_string(status));
}

}  // namespace legopt::client
