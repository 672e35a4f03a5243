#include "client/plot/drawing.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "app/printable.h"
#include "client/client_error.h"
#include "client/plot/curve_look.h"
#include "client/plot/panel_drawing.h"
#include "client/plot/pdf_canvas.h"
#include "client/plot/pgf_canvas.h"
#include "client/plot/svg_canvas.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

constexpr double kMargin = 16.0, kNarrowMargin = 10.0, kGap = 24.0, kTitle = 10.5;
constexpr double kWide = 720.0;

bool HasPlane(const PlotPanel& panel) { return panel.kind != PlotKind::kRanks; }

/// A figure with chosen widths, drawn from the upper left corner downwards.
class Drawing {
 public:
  /// `stretch`: height added to each row of planes.
  Drawing(const Plot& plot, const FigureStyle& style, double stretch, Canvas* canvas);

  /// Draws the whole figure; returns its height.
  double Draw();

  double width() const { return width_; }
  int rows() const { return (static_cast<int>(plot_.panels.size()) + columns_ - 1) / columns_; }

 private:
  double Scaled(double length) const { return scale_ * length; }
  double PanelWidth() const { return (width_ - 2.0 * margin_ - (columns_ - 1) * Scaled(kGap)) / columns_; }
  double TitleHeight(std::size_t first) const;
  double RowHeight(std::size_t first) const;
  double DrawPanel(const PlotPanel& panel, const Rectangle& frame, double plane_height);
  double DrawLegend(double top);
  double Paragraph(const std::string& text, const Rectangle& frame, double font, const Color& color);

  const Plot& plot_;
  double font_, scale_, width_, margin_, stretch_;
  int columns_ = 1;
  Canvas& canvas_;
};

Drawing::Drawing(const Plot& plot, const FigureStyle& style, double stretch, Canvas* canvas)
    : plot_(plot),
      font_(style.font_size),
      scale_(style.font_size / kUsualFont),
      width_(
          style.width.value_or(Scaled(plot.panels.size() == 1 && HasPlane(plot.panels.front()) ? 0.5 * kWide : kWide))),
      margin_(Scaled(style.width ? kNarrowMargin : kMargin)),
      stretch_(stretch),
      canvas_(*canvas) {
  constexpr double kNarrowest = 220.0;                             // narrowest panel
  const bool planes = std::ranges::all_of(plot.panels, HasPlane);  // names beside ranks need the whole width
  if (plot.panels.size() > 1 && planes && 0.5 * width_ >= Scaled(kNarrowest)) columns_ = 2;
}

double Drawing::Paragraph(const std::string& text, const Rectangle& frame, double font, const Color& color) {
  double y = frame.top;
  for (const std::string& line : WrappedText(text, frame.width, font)) {
    y += Scaled(kLineHeight);
    canvas_.Text(app::Printable(line), {frame.left, y}, {color, font, Align::kStart, false});
  }
  return y;
}

// Returns the common height of the titles of a row of panels.
double Drawing::TitleHeight(std::size_t first) const {
  std::size_t lines = 0;
  const std::size_t end = std::min(first + static_cast<std::size_t>(columns_), plot_.panels.size());
  for (std::size_t i = first; i < end; ++i) {
    lines = std::max(lines, WrappedText(plot_.panels[i].title, PanelWidth(), Scaled(kTitle)).size());
  }
  return Scaled(kLineHeight) * static_cast<double>(lines);
}

double Drawing::RowHeight(std::size_t first) const {
  double height = 0.0;
  const std::size_t end = std::min(first + static_cast<std::size_t>(columns_), plot_.panels.size());
  for (std::size_t i = first; i < end; ++i) height = std::max(height, PlaneHeightOf(plot_.panels[i], font_));
  return height + stretch_;
}

// `frame.height` is that of the title. Returns the y coordinate below.
double Drawing::DrawPanel(const PlotPanel& panel, const Rectangle& frame, double plane_height) {
  Paragraph(panel.title, frame, Scaled(kTitle), kInk);
  const double labels = HasPlane(panel) ? Scaled(kLabelWidth) : 0.0;
  const Rectangle plane{frame.left + labels, frame.top + frame.height + Scaled(kLineHeight), frame.width - labels,
                        plane_height};
  PanelDrawing(plot_, panel, plane, font_, &canvas_).Draw();
  double below = plane.top + plane.height + (HasPlane(panel) ? 2.0 * Scaled(kLineHeight) : 0.0);
  for (const std::string& note : panel.notes) {
    below = Paragraph(note, {plane.left, below, plane.width, 0.0}, font_, kFaint);
  }
  return below;
}

// Draws the names in up to three columns.
double Drawing::DrawLegend(double top) {
  constexpr std::size_t kMostColumns = 3;
  constexpr double kSample = 30.0, kApart = 6.0, kLift = 3.0;
  double widest = Scaled(1.0);
  for (const std::string& entry : plot_.entries) widest = std::max(widest, WidthOf(app::Printable(entry), font_));
  const double room = width_ - 2.0 * margin_;
  const auto fitting = static_cast<std::size_t>(room / (widest + Scaled(kSample + 2.0 * kApart)));
  const std::size_t columns = std::clamp<std::size_t>(fitting, 1, kMostColumns);
  for (std::size_t entry = 0; entry < plot_.entries.size(); ++entry) {
    const double left = margin_ + room / static_cast<double>(columns) * static_cast<double>(entry % columns);
    if (entry % columns == 0) top += Scaled(kLineHeight + kLift);
    const double line = top - Scaled(kLift);
    canvas_.Line({left, line}, {left + Scaled(kSample), line}, StrokeOf(entry, scale_));
    DrawMark(entry, {left + 0.5 * Scaled(kSample), line}, scale_, 1.0, &canvas_);
    canvas_.Text(app::Printable(plot_.entries[entry]), {left + Scaled(kSample + kApart), top},
                 {kInk, font_, Align::kStart, false});
  }
  return top;
}

double Drawing::Draw() {
  double top = margin_, bottom = margin_;
  for (std::size_t i = 0; i < plot_.panels.size(); ++i) {
    const std::size_t column = i % static_cast<std::size_t>(columns_), first = i - column;
    if (column == 0) top = bottom;
    const double left = margin_ + static_cast<double>(column) * (PanelWidth() + Scaled(kGap));
    const Rectangle frame{left, top, PanelWidth(), TitleHeight(first)};
    bottom = std::max(bottom, DrawPanel(plot_.panels[i], frame, RowHeight(first)) + Scaled(kLineHeight));
  }
  const bool legend = plot_.panels.empty() || std::any_of(plot_.panels.begin(), plot_.panels.end(), HasPlane);
  if (legend && !plot_.entries.empty()) bottom = DrawLegend(bottom) + Scaled(kLineHeight);
  return Paragraph(plot_.caption, {margin_, bottom, width_ - 2.0 * margin_, 0.0}, font_, kFaint) + margin_;
}

// Returns the height to be added to each row of planes so that the figure has the chosen height. Throws ClientError
// (kUsage) if the planes would become too small.
double StretchFor(const Plot& plot, const FigureStyle& style) {
  constexpr double kSmallest = 80.0, kInch = 72.0;  // width and height of a plane
  NoCanvas nothing;
  Drawing natural(plot, style, 0.0, &nothing);
  const double height = natural.Draw(), scale = style.font_size / kUsualFont;
  double room = INFINITY;  // amount by which each row may shrink
  for (const PlotPanel& panel : plot.panels) {
    room = std::min(room, HasPlane(panel) ? PlaneHeightOf(panel, style.font_size) - scale * kSmallest : 0.0);
  }
  const double least_width = scale * (kLabelWidth + kSmallest + 2.0 * kNarrowMargin);
  if (natural.width() < least_width) {
    throw ClientError(ExitCode::kUsage, "the figure is too narrow for this font size; give at least " +
                                            FormatFixed(least_width / kInch, 1) + " inches");
  }
  if (!style.height || plot.panels.empty()) return 0.0;
  const double stretch = (*style.height - height) / static_cast<double>(natural.rows());
  if (stretch >= -room) return stretch;
  const double least_height = height - room * static_cast<double>(natural.rows());
  constexpr double kTenth = 0.1;
  throw ClientError(ExitCode::kUsage, "the figure is too low: titles, axes, legend and caption need " +
                                          FormatFixed(kTenth * std::ceil(least_height / kInch / kTenth), 1) +
                                          " inches at this width and font size; choose fewer curves or panels, "
                                          "--no-caption or a smaller font");
}

std::unique_ptr<Canvas> CanvasOf(PlotFormat format, double width, double height, double font_size) {
  switch (format) {
    case PlotFormat::kPdf:
      return std::make_unique<PdfCanvas>(width, height);
    case PlotFormat::kPgf:
      return std::make_unique<PgfCanvas>(width, height);
    case PlotFormat::kSvg:
      break;
  }
  return std::make_unique<SvgCanvas>(width, height, font_size);
}

}  // namespace

std::string RenderFigure(const Plot& plot, PlotFormat format, const FigureStyle& style) {
  if (plot.panels.size() > kMaxPanels) {
    throw ClientError(ExitCode::kUsage,
                      std::to_string(plot.panels.size()) + " panels are too many for one figure (at most " +
                          std::to_string(kMaxPanels) + "); choose some by --methods, --tasks or --initializations");
  }
  const double stretch = StretchFor(plot, style);
  NoCanvas nothing;
  Drawing measured(plot, style, stretch, &nothing);
  const double height = measured.Draw();
  const auto canvas = CanvasOf(format, measured.width(), height, style.font_size);
  Drawing(plot, style, stretch, canvas.get()).Draw();
  return canvas->Finish();
}

}  // namespace legopt::client
