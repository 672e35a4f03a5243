#include "client/plot/plot_image.h"

#include <cairo-svg.h>
#include <cairo.h>

#include <cmath>
#include <memory>

#include "client/client_error.h"
#include "client/plot/drawing.h"

namespace legopt::client {
namespace {

constexpr double kPngScale = 2.0;

cairo_status_t Append(void* bytes, const unsigned char* data, unsigned length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

void Require(cairo_status_t status) {
  if (status == CAIRO_STATUS_SUCCESS) return;
  throw ClientError(ExitCode::kMachine,
                    std::string("the figure could not be drawn: ") + cairo_status_to_string(status));
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

// Draws the figure; returns its height.
double DrawOn(cairo_surface_t* surface, double scale, const Plot& plot) {
  const Context context(cairo_create(surface), cairo_destroy);
  cairo_scale(context.get(), scale, scale);
  cairo_set_source_rgb(context.get(), 1.0, 1.0, 1.0);
  cairo_paint(context.get());
  Drawing drawing(context.get());
  const double height = drawing.DrawPlot(plot);
  Require(cairo_status(context.get()));
  return height;
}

// The height depends on the text layout, so this draws once on a dummy surface.
double HeightOf(const Plot& plot) {
  const Surface nothing(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1), cairo_surface_destroy);
  return DrawOn(nothing.get(), 1.0, plot);
}

std::string Svg(const Plot& plot, double height) {
  std::string bytes;
  {
    const Surface surface(cairo_svg_surface_create_for_stream(Append, &bytes, kFigureWidth_pt, height),
                          cairo_surface_destroy);
    DrawOn(surface.get(), 1.0, plot);
    cairo_surface_finish(surface.get());
    Require(cairo_surface_status(surface.get()));
  }
  return bytes;
}

std::string Png(const Plot& plot, double height) {
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kPngScale * kFigureWidth_pt),
                                                   static_cast<int>(std::ceil(kPngScale * height))),
                        cairo_surface_destroy);
  DrawOn(surface.get(), kPngScale, plot);
  std::string bytes;
  Require(cairo_surface_write_to_png_stream(surface.get(), Append, &bytes));
  return bytes;
}

}  // namespace

std::string RenderPlotImage(const Plot& plot, ImageFormat format) {
  if (plot.panels.size() > kMaxPanels) {
    throw ClientError(ExitCode::kUsage,
                      std::to_string(plot.panels.size()) + " panels are too many for one figure (at most " +
                          std::to_string(kMaxPanels) + "); choose some, as by --method, --task or --initialization");
  }
  const double height = HeightOf(plot);
  return format == ImageFormat::kSvg ? Svg(plot, height) : Png(plot, height);
}

}  // namespace legopt::client
