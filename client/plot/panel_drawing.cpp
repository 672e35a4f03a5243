#include "client/plot/panel_drawing.h"

#include <algorithm>
#include <cmath>

#include "client/plot/curve_look.h"

namespace legopt::client {
namespace {

constexpr double kRim = 34.0;
constexpr double kRankAxis = 2.0, kRankGap = 0.6;  // lines above the axis of ranks, and between bars

}  // namespace

PanelDrawing::PanelDrawing(const Plot& plot, const PlotPanel& panel, const Rectangle& plane, double font_size,
                           Canvas* canvas)
    : plot_(plot), panel_(panel), plane_(plane), font_(font_size), scale_(font_size / kUsualFont), canvas_(*canvas) {}

double PanelDrawing::Across(double x) const {
  if (std::isinf(x) && panel_.x.rim) return plane_.left + plane_.width - 0.5 * Scaled(kRim);
  return plane_.left + (plane_.width - (panel_.x.rim ? Scaled(kRim) : 0.0)) * PlaceOn(panel_.x, x);
}

double PanelDrawing::Down(double y) const {
  if (std::isinf(y) && panel_.y.rim) return plane_.top + 0.5 * Scaled(kRim);
  const double rim = panel_.y.rim ? Scaled(kRim) : 0.0;
  return plane_.top + rim + (plane_.height - rim) * (1.0 - PlaceOn(panel_.y, y));
}

void PanelDrawing::Text(std::string_view text, double x, double y, Align align, const Color& color, bool upwards) {
  canvas_.Text(text, {x, y}, {color, font_, align, upwards});
}

void PanelDrawing::DrawHorizontalAxis() {
  constexpr double kPerLabel = 45.0, kBeyond = 6.0;
  constexpr int kMost = 7;
  const double bottom = plane_.top + plane_.height;
  const int most = std::clamp(static_cast<int>(plane_.width / Scaled(kPerLabel)), 2, kMost);
  if (panel_.x.labelled) {
    for (const PlotTick& tick : TicksOf(panel_.x, most)) {
      const double x = Across(tick.value);
      canvas_.Line({x, plane_.top}, {x, bottom}, {kGrid});
      Text(tick.label, x, bottom + Scaled(kLineHeight), Align::kMiddle, kInk);
    }
  }
  if (panel_.x.rim) {
    const double x = plane_.left + plane_.width - Scaled(kRim);
    canvas_.Line({x, plane_.top}, {x, bottom}, {kFaint});
    Text("failed", plane_.left + plane_.width + Scaled(kBeyond), bottom + Scaled(kLineHeight), Align::kEnd, kFaint);
  }
  Text(panel_.x.title, plane_.left + 0.5 * plane_.width, bottom + 2.0 * Scaled(kLineHeight), Align::kMiddle, kInk);
}

void PanelDrawing::DrawVerticalAxis() {
  constexpr double kPerLabel = 25.0, kApart = 5.0, kDrop = 3.0;
  constexpr int kMost = 6;
  const int most = std::clamp(static_cast<int>(plane_.height / Scaled(kPerLabel)), 2, kMost);
  for (const PlotTick& tick : TicksOf(panel_.y, most)) {
    const double y = Down(tick.value);
    canvas_.Line({plane_.left, y}, {plane_.left + plane_.width, y}, {kGrid});
    Text(tick.label, plane_.left - Scaled(kApart), y + Scaled(kDrop), Align::kEnd, kInk);
  }
  if (panel_.y.rim) {
    const double y = plane_.top + Scaled(kRim);
    canvas_.Line({plane_.left, y}, {plane_.left + plane_.width, y}, {kFaint});
    Text("failed", plane_.left - Scaled(kApart), plane_.top + Scaled(0.5 * kRim + kDrop), Align::kEnd, kFaint);
  }
  Text(panel_.y.title, plane_.left - Scaled(kLabelWidth - kDrop), plane_.top + 0.5 * plane_.height, Align::kMiddle,
       kInk, true);
}

void PanelDrawing::DrawDiagonal() {
  const double from = std::max(panel_.x.from, panel_.y.from), to = std::min(panel_.x.to, panel_.y.to);
  canvas_.Line({Across(from), Down(from)}, {Across(to), Down(to)}, {kFaint});
}

void PanelDrawing::DrawSteps(const PlotSeries& series) {
  constexpr double kMarksApart = 90.0, kShift = 11.0;
  double y = Down(0.0), x = plane_.left;
  // Offset the marks of different series so that they do not overlap.
  double next = plane_.left + Scaled(std::fmod(kShift * static_cast<double>(series.entry) + kShift, kMarksApart));
  std::vector<CanvasPoint> marks, curve{{x, y}};
  const auto across = [&](double to) {
    for (; next < to; next += Scaled(kMarksApart)) marks.emplace_back(next, y);
    x = to;
    curve.emplace_back(x, y);
  };
  for (const PlotPoint& step : series.points) {
    across(Across(step.x));
    y = Down(step.y);
    curve.emplace_back(x, y);
  }
  across(plane_.left + plane_.width);
  canvas_.Polyline(curve, StrokeOf(series.entry, scale_));
  for (const CanvasPoint& mark : marks) DrawMark(series.entry, mark, scale_, 1.0, &canvas_);
}

void PanelDrawing::DrawLines(const PlotSeries& series) {
  constexpr double kSeeThrough = 0.15, kMarksApart = 60.0;
  std::vector<CanvasPoint> curve, around;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    const double x = Across(series.points[i].x);
    if (!series.band.empty()) around.emplace_back(x, Down(series.band[i].high));
    if (std::isfinite(series.points[i].y)) curve.emplace_back(x, Down(series.points[i].y));
  }
  for (std::size_t i = series.band.size(); i-- > 0;) {
    around.emplace_back(Across(series.points[i].x), Down(series.band[i].low));
  }
  if (!around.empty()) canvas_.Polygon(around, {ColorOf(series.entry), {}, kSeeThrough});
  if (curve.empty()) return;
  canvas_.Polyline(curve, StrokeOf(series.entry, scale_));
  double last = -INFINITY;
  for (const CanvasPoint& point : curve) {
    if (point.first - last < Scaled(kMarksApart)) continue;
    DrawMark(series.entry, point, scale_, 1.0, &canvas_);
    last = point.first;
  }
}

void PanelDrawing::DrawPoints(const PlotSeries& series) {
  constexpr double kSeeThrough = 0.55;
  for (const PlotPoint& point : series.points) {
    DrawMark(series.entry, {Across(point.x), Down(point.y)}, scale_, kSeeThrough, &canvas_);
  }
}

void PanelDrawing::DrawBox(const PlotSeries& series) {
  constexpr double kSeeThrough = 0.25, kWidest = 40.0, kShare = 0.6, kMedian = 1.4;
  const PlotBox& box = *series.box;
  const double middle = Across(series.points.front().x);
  const double space = plane_.width / std::max<double>(static_cast<double>(panel_.series.size()), 1.0);
  const double half = 0.5 * std::min(kShare * space, Scaled(kWidest));
  const double top = Down(box.quartiles.high), bottom = Down(box.quartiles.low), median = Down(box.median);
  const Stroke stroke{ColorOf(series.entry), Scaled(1.0)};
  canvas_.Line({middle, Down(box.whiskers.high)}, {middle, top}, stroke);
  canvas_.Line({middle, bottom}, {middle, Down(box.whiskers.low)}, stroke);
  for (const double end : {box.whiskers.low, box.whiskers.high}) {
    canvas_.Line({middle - 0.5 * half, Down(end)}, {middle + 0.5 * half, Down(end)}, stroke);
  }
  canvas_.Box({middle - half, top, 2.0 * half, bottom - top}, {stroke.color, {}, kSeeThrough});
  canvas_.Box({middle - half, top, 2.0 * half, bottom - top}, {{}, stroke, 1.0});
  canvas_.Line({middle - half, median}, {middle + half, median}, {stroke.color, Scaled(kMedian)});
  DrawMark(series.entry, {middle, median}, scale_, 1.0, &canvas_);
}

// Draws the name beside the plane's side, and a line from it to the point on the axis.
void PanelDrawing::DrawRankName(const PlotSeries& series, double level, bool left) {
  constexpr double kApart = 4.0, kDrop = 3.0;
  const std::string& name = plot_.entries[series.entry];
  const double x = Across(series.points.front().x), axis = plane_.top + Scaled(kRankAxis * kLineHeight);
  const double side = left ? plane_.left - Scaled(kApart) : plane_.left + plane_.width + Scaled(kApart);
  canvas_.Polyline({{x, axis}, {x, level}, {side, level}}, {ColorOf(series.entry), Scaled(1.0)});
  DrawMark(series.entry, {x, axis}, scale_, 1.0, &canvas_);
  Text(name, left ? side - Scaled(kApart) : side + Scaled(kApart), level + Scaled(kDrop),
       left ? Align::kEnd : Align::kStart, kInk);
}

// As in Demsar 2006 (J. Mach. Learn. Res. 7:1), with the best rank on the left.
void PanelDrawing::DrawRanks() {
  constexpr double kTick = 4.0, kThick = 3.0, kMostInset = 0.4;
  double longest = 0.0;
  for (const PlotSeries& series : panel_.series)
    longest = std::max(longest, WidthOf(plot_.entries[series.entry], font_));
  const double inset = std::min(longest + Scaled(kLineHeight), kMostInset * plane_.width);
  plane_ = {plane_.left + inset, plane_.top, plane_.width - 2.0 * inset, plane_.height};
  const double axis = plane_.top + Scaled(kRankAxis * kLineHeight);
  Text(panel_.x.title, plane_.left + 0.5 * plane_.width, plane_.top, Align::kMiddle, kInk);
  canvas_.Line({plane_.left, axis}, {plane_.left + plane_.width, axis}, {kInk, Scaled(1.0)});
  for (int rank = 1; rank <= static_cast<int>(panel_.x.to); ++rank) {
    const double x = Across(rank);
    canvas_.Line({x, axis - Scaled(kTick)}, {x, axis}, {kInk, Scaled(1.0)});
    Text(std::to_string(rank), x, axis - Scaled(kTick + 2.0), Align::kMiddle, kInk);
  }
  double level = axis;
  for (const PlotRange& group : panel_.groups) {
    level += Scaled(kRankGap * kLineHeight);
    canvas_.Line({Across(group.low) - Scaled(kTick), level}, {Across(group.high) + Scaled(kTick), level},
                 {kInk, Scaled(kThick)});
  }
  const std::size_t count = panel_.series.size(), left = (count + 1) / 2;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t line = i < left ? i : count - 1 - i;
    DrawRankName(panel_.series[i], level + Scaled(kLineHeight * static_cast<double>(line + 1)), i < left);
  }
}

void PanelDrawing::Draw() {
  if (panel_.kind == PlotKind::kRanks) return DrawRanks();
  DrawHorizontalAxis();
  DrawVerticalAxis();
  canvas_.Box(plane_, {{}, Stroke{kFaint}, 1.0});
  if (panel_.kind == PlotKind::kPoints) DrawDiagonal();
  for (const PlotSeries& series : panel_.series) {
    if (panel_.kind == PlotKind::kSteps) DrawSteps(series);
    if (panel_.kind == PlotKind::kLines) DrawLines(series);
    if (panel_.kind == PlotKind::kPoints) DrawPoints(series);
    if (panel_.kind == PlotKind::kBoxes) DrawBox(series);
  }
}

double PlaneHeightOf(const PlotPanel& panel, double font_size) {
  constexpr double kUsual = 190.0;
  if (panel.kind != PlotKind::kRanks) return kUsual * font_size / kUsualFont;
  const std::size_t names = (panel.series.size() + 1) / 2;  // on each side
  const double lines =
      kRankAxis + kRankGap * static_cast<double>(panel.groups.size()) + static_cast<double>(names) + 1.0;
  return kLineHeight * lines * font_size / kUsualFont;
}

}  // namespace legopt::client
