#include "client/plot/drawing.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "legopt/types/classic_stream.h"

namespace legopt::client {
namespace {

struct Color {
  double red, green, blue;
};
// Colours of Okabe and Ito (2008), as on the page; the light ones are darkened for lines on white.
constexpr std::array<Color, 8> kColors = {{{0.00, 0.45, 0.70},
                                           {0.84, 0.37, 0.00},
                                           {0.00, 0.62, 0.45},
                                           {0.66, 0.35, 0.54},
                                           {0.72, 0.50, 0.00},
                                           {0.17, 0.55, 0.75},
                                           {0.20, 0.20, 0.20},
                                           {0.55, 0.32, 0.04}}};
const std::array<std::vector<double>, 5> kDashes = {{{}, {7, 3}, {2, 2}, {9, 3, 2, 3}, {5, 2, 1, 2, 1, 2}}};

constexpr double kMargin = 16.0, kGap = 24.0, kPlaneHeight = 190.0, kLine = 12.0, kFont = 9.0, kTitleFont = 10.5;
constexpr double kLeftLabels = 40.0, kRim = 34.0, kMark = 3.0, kThin = 0.6, kThick = 1.4;
constexpr double kInk = 0.11, kFaint = 0.45, kGrid = 0.88, kHalf = 0.5;

// Returns the x coordinate of a value; infinite values are on the rim.
double Across(const PlotAxis& axis, double value, const Frame& plane) {
  const double width = plane.width - (axis.rim ? kRim : 0.0);
  if (std::isinf(value)) return plane.left + plane.width - kHalf * kRim;
  return plane.left + width * PlaceOn(axis, value);
}

double Down(const PlotAxis& axis, double value, const Frame& plane) {
  const double rim = axis.rim ? kRim : 0.0;
  if (std::isinf(value)) return plane.top + kHalf * kRim;
  return plane.top + rim + (plane.height - rim) * (1.0 - PlaceOn(axis, value));
}

}  // namespace

Drawing::Drawing(cairo_t* context) : context_(context) {
  cairo_select_font_face(context_, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context_, kFont);
}

void Drawing::SetGrey(double level) { cairo_set_source_rgb(context_, level, level, level); }

void Drawing::SetLine(std::size_t entry) {
  const Color& color = kColors[entry % kColors.size()];
  cairo_set_source_rgb(context_, color.red, color.green, color.blue);
  // Series with the same colour have different dashes.
  const auto& dash = kDashes[(entry + entry / kColors.size()) % kDashes.size()];
  cairo_set_dash(context_, dash.data(), static_cast<int>(dash.size()), 0.0);
  cairo_set_line_width(context_, kThick);
}

void Drawing::Line(double x0, double y0, double x1, double y1) {
  cairo_move_to(context_, x0, y0);
  cairo_line_to(context_, x1, y1);
  cairo_stroke(context_);
}

double Drawing::WidthOf(const std::string& text) {
  cairo_text_extents_t extents;
  cairo_text_extents(context_, text.c_str(), &extents);
  return extents.x_advance;
}

void Drawing::Text(const std::string& text, double x, double y, Align align) {
  const double share = align == Align::kLeft ? 0.0 : align == Align::kMiddle ? kHalf : 1.0;
  cairo_move_to(context_, x - share * WidthOf(text), y);
  cairo_show_text(context_, text.c_str());
}

std::vector<std::string> Drawing::Wrapped(const std::string& text, double width) {
  std::vector<std::string> lines;
  ClassicInput words(text);
  for (std::string word; words >> word;) {
    if (lines.empty() || WidthOf(lines.back() + " " + word) > width) {
      lines.push_back(word);
    } else {
      lines.back() += " " + word;
    }
  }
  return lines;
}

double Drawing::Paragraph(const std::string& text, double left, double top, double width) {
  for (const std::string& line : Wrapped(text, width)) {
    top += kLine;
    Text(line, left, top);
  }
  return top;
}

double Drawing::TitleHeight(const Plot& plot, std::size_t first, double width) {
  cairo_set_font_size(context_, kTitleFont);
  std::size_t lines = 0;
  for (std::size_t i = first; i < std::min(first + 2, plot.panels.size()); ++i) {
    lines = std::max(lines, Wrapped(plot.panels[i].title, width).size());
  }
  cairo_set_font_size(context_, kFont);
  return kLine * static_cast<double>(lines);
}

// Shapes as on the page: disc, square, triangle, diamond, then the same shapes hollow.
void Drawing::DrawMark(std::size_t entry, double x, double y) {
  constexpr std::size_t kShapes = 4;
  cairo_set_dash(context_, nullptr, 0, 0.0);
  cairo_new_path(context_);
  switch (entry % kShapes) {
    case 0:
      cairo_arc(context_, x, y, kMark, 0.0, 2.0 * std::numbers::pi);
      break;
    case 1:
      cairo_rectangle(context_, x - kMark, y - kMark, 2.0 * kMark, 2.0 * kMark);
      break;
    case 2:
      cairo_move_to(context_, x, y - kMark);
      cairo_line_to(context_, x + kMark, y + kMark);
      cairo_line_to(context_, x - kMark, y + kMark);
      cairo_close_path(context_);
      break;
    default:
      cairo_move_to(context_, x, y - kMark);
      cairo_line_to(context_, x + kMark, y);
      cairo_line_to(context_, x, y + kMark);
      cairo_line_to(context_, x - kMark, y);
      cairo_close_path(context_);
  }
  if (entry / kShapes % 2 == 0) {
    cairo_fill(context_);
  } else {
    cairo_set_line_width(context_, 1.0);
    cairo_stroke(context_);
  }
}

void Drawing::DrawHorizontalAxis(const PlotAxis& axis, const Frame& plane) {
  constexpr int kMost = 7;
  constexpr double kBeyond = 6.0;
  const double bottom = plane.top + plane.height;
  for (const PlotTick& tick : TicksOf(axis, kMost)) {
    const double x = Across(axis, tick.value, plane);
    SetGrey(kGrid);
    Line(x, plane.top, x, bottom);
    SetGrey(kInk);
    Text(tick.label, x, bottom + kLine, Align::kMiddle);
  }
  if (axis.rim) {
    const double x = plane.left + plane.width - kRim;
    SetGrey(kFaint);
    Line(x, plane.top, x, bottom);
    Text("failed", plane.left + plane.width + kBeyond, bottom + kLine, Align::kRight);
  }
  SetGrey(kInk);
  Text(axis.title, plane.left + kHalf * plane.width, bottom + 2.0 * kLine, Align::kMiddle);
}

void Drawing::DrawVerticalAxis(const PlotAxis& axis, const Frame& plane) {
  constexpr int kMost = 6;
  constexpr double kApart = 5.0, kDrop = 3.0;
  for (const PlotTick& tick : TicksOf(axis, kMost)) {
    const double y = Down(axis, tick.value, plane);
    SetGrey(kGrid);
    Line(plane.left, y, plane.left + plane.width, y);
    SetGrey(kInk);
    Text(tick.label, plane.left - kApart, y + kDrop, Align::kRight);
  }
  if (axis.rim) {
    SetGrey(kFaint);
    Line(plane.left, plane.top + kRim, plane.left + plane.width, plane.top + kRim);
    Text("failed", plane.left - kApart, plane.top + kHalf * kRim + kDrop, Align::kRight);
  }
  SetGrey(kInk);
  cairo_save(context_);
  cairo_translate(context_, plane.left - kLeftLabels + kApart - 2.0, plane.top + kHalf * plane.height);
  cairo_rotate(context_, -kHalf * std::numbers::pi);
  Text(axis.title, 0.0, 0.0, Align::kMiddle);
  cairo_restore(context_);
}

void Drawing::DrawAxes(const PlotPanel& panel, const Frame& plane) {
  cairo_set_dash(context_, nullptr, 0, 0.0);
  cairo_set_line_width(context_, kThin);
  DrawHorizontalAxis(panel.x, plane);
  DrawVerticalAxis(panel.y, plane);
  SetGrey(kFaint);
  cairo_rectangle(context_, plane.left, plane.top, plane.width, plane.height);
  cairo_stroke(context_);
  if (panel.kind != PlotKind::kPoints) return;
  const double from = std::max(panel.x.from, panel.y.from), to = std::min(panel.x.to, panel.y.to);
  Line(Across(panel.x, from, plane), Down(panel.y, from, plane), Across(panel.x, to, plane), Down(panel.y, to, plane));
}

void Drawing::DrawSteps(const PlotPanel& panel, const PlotSeries& series, const Frame& plane) {
  constexpr double kMarksApart = 90.0, kShift = 11.0;
  SetLine(series.entry);
  double y = Down(panel.y, 0.0, plane), x = plane.left;
  // Offset the marks of different series so that they do not overlap.
  double next = plane.left + std::fmod(kShift * static_cast<double>(series.entry) + kShift, kMarksApart);
  std::vector<std::pair<double, double>> marks;
  cairo_move_to(context_, x, y);
  const auto across = [&](double to) {
    for (; next < to; next += kMarksApart) marks.emplace_back(next, y);
    x = to;
    cairo_line_to(context_, x, y);
  };
  for (const PlotPoint& step : series.points) {
    across(Across(panel.x, step.x, plane));
    y = Down(panel.y, step.y, plane);
    cairo_line_to(context_, x, y);
  }
  across(plane.left + plane.width);
  cairo_stroke(context_);
  for (const auto& [at, level] : marks) DrawMark(series.entry, at, level);
}

void Drawing::DrawPoints(const PlotPanel& panel, const PlotSeries& series, const Frame& plane) {
  constexpr double kSeeThrough = 0.55;
  const Color& color = kColors[series.entry % kColors.size()];
  for (const PlotPoint& point : series.points) {
    cairo_set_source_rgba(context_, color.red, color.green, color.blue, kSeeThrough);
    DrawMark(series.entry, Across(panel.x, point.x, plane), Down(panel.y, point.y, plane));
  }
}

double Drawing::DrawPanel(const PlotPanel& panel, const Frame& frame) {
  SetGrey(kInk);
  cairo_set_font_size(context_, kTitleFont);
  Paragraph(panel.title, frame.left, frame.top, frame.width);
  cairo_set_font_size(context_, kFont);
  const Frame plane{frame.left + kLeftLabels, frame.top + frame.height + kLine, frame.width - kLeftLabels,
                    kPlaneHeight};
  DrawAxes(panel, plane);
  cairo_save(context_);
  for (const PlotSeries& series : panel.series) {
    if (panel.kind == PlotKind::kSteps) {
      DrawSteps(panel, series, plane);
    } else {
      DrawPoints(panel, series, plane);
    }
  }
  cairo_restore(context_);
  SetGrey(kFaint);
  double below = plane.top + plane.height + 2.0 * kLine;
  for (const std::string& note : panel.notes) below = Paragraph(note, plane.left, below, plane.width);
  return below;
}

// Draws the names in three columns.
double Drawing::DrawLegend(const Plot& plot, double top) {
  constexpr int kColumns = 3;
  constexpr double kSample = 30.0, kApart = 6.0, kLift = 3.0;
  const double width = (kFigureWidth_pt - 2.0 * kMargin) / kColumns;
  for (std::size_t entry = 0; entry < plot.entries.size(); ++entry) {
    const double left = kMargin + width * static_cast<double>(entry % kColumns);
    if (entry % kColumns == 0) top += kLine + kLift;
    SetLine(entry);
    Line(left, top - kLift, left + kSample, top - kLift);
    DrawMark(entry, left + kHalf * kSample, top - kLift);
    SetGrey(kInk);
    Text(plot.entries[entry], left + kSample + kApart, top);
  }
  return top;
}

double Drawing::DrawPlot(const Plot& plot) {
  const double width = kHalf * (kFigureWidth_pt - 2.0 * kMargin - kGap);
  double top = kMargin, bottom = kMargin, title = 0.0;
  for (std::size_t i = 0; i < plot.panels.size(); ++i) {
    const bool right = i % 2 == 1;
    if (!right) {
      top = bottom;
      title = TitleHeight(plot, i, width);
    }
    const Frame frame{kMargin + (right ? width + kGap : 0.0), top, width, title};
    bottom = std::max(bottom, DrawPanel(plot.panels[i], frame) + kLine);
  }
  if (!plot.entries.empty()) bottom = DrawLegend(plot, bottom) + kLine;
  SetGrey(kFaint);
  return Paragraph(plot.caption, kMargin, bottom, kFigureWidth_pt - 2.0 * kMargin) + kMargin;
}

}  // namespace legopt::client
