#include "client/plot/plot_svg.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string_view>
#include <utility>
#include <vector>

#include "app/printable.h"
#include "client/client_error.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

// Colours of Okabe and Ito (2008), as on the page; the light ones are darkened for lines on white.
constexpr std::array<std::string_view, 8> kColors = {"#0072b2", "#d65e00", "#009e73", "#a8598a",
                                                     "#b88000", "#2b8cbf", "#333333", "#8c520a"};
constexpr std::array<std::string_view, 5> kDashes = {"", "7 3", "2 2", "9 3 2 3", "5 2 1 2 1 2"};
constexpr std::string_view kInk = "#1c1c1c", kFaint = "#737373", kGrid = "#e0e0e0";

constexpr double kFigureWidth = 720.0, kMargin = 16.0, kGap = 24.0, kPlaneHeight = 190.0, kLine = 12.0;
constexpr double kFont = 9.0, kTitleFont = 10.5;
constexpr double kLeftLabels = 40.0, kRim = 34.0, kMark = 3.0, kThin = 0.6, kThick = 1.4, kHalf = 0.5;

/// A rectangle of a figure, in points from its upper left corner.
struct Frame {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
};

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

// Estimates the width of a text in a sans-serif font, rather too wide than too narrow.
double WidthOf(std::string_view text, double font) {
  constexpr double kNarrow = 0.36, kUsual = 0.58, kWide = 0.9;
  double width = 0.0;
  for (const char c : text) {
    const bool continues = (static_cast<unsigned char>(c) & 0xC0U) == 0x80U;  // a UTF-8 character
    if (continues) continue;
    const bool narrow = std::string_view(" .,:;'|!()[]/-fijlrtI").find(c) != std::string_view::npos;
    const bool wide = std::string_view("mwMW%@").find(c) != std::string_view::npos;
    width += narrow ? kNarrow : wide ? kWide : kUsual;
  }
  return width * font;
}

// Breaks the text at words into lines of at most `width`.
std::vector<std::string> WrappedText(const std::string& text, double width, double font) {
  std::vector<std::string> lines;
  ClassicInput words(text);
  for (std::string word; words >> word;) {
    if (lines.empty() || WidthOf(lines.back() + " " + word, font) > width) {
      lines.push_back(word);
    } else {
      lines.back() += " " + word;
    }
  }
  return lines;
}

std::string EscapedXml(std::string_view text) {
  std::string escaped;
  for (const char c : app::Printable(text)) {
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

/// Look of a line.
struct Stroke {
  std::string_view color;
  double width = kThin;
  std::string_view dash = "";
};

enum class Align { kStart, kMiddle, kEnd };

/// Body of an SVG file, to which elements are added.
class SvgBody {
 public:
  using Points = std::vector<std::pair<double, double>>;

  void Line(double x0, double y0, double x1, double y1, const Stroke& stroke) {
    Open("line", {{"x1", x0}, {"y1", y0}, {"x2", x1}, {"y2", y1}});
    Finish(Attributes(stroke));
  }
  void Polyline(const Points& points, const Stroke& stroke) {
    Open("polyline", {});
    Finish(" points=\"" + Text(points) + "\"" + Attributes(stroke));
  }
  void Rectangle(const Frame& frame, const std::string& look) {
    Open("rect", {{"x", frame.left}, {"y", frame.top}, {"width", frame.width}, {"height", frame.height}});
    Finish(look);
  }
  void Circle(double x, double y, double radius, const std::string& look) {
    Open("circle", {{"cx", x}, {"cy", y}, {"r", radius}});
    Finish(look);
  }
  void Polygon(const Points& corners, const std::string& look) {
    Open("polygon", {});
    Finish(" points=\"" + Text(corners) + "\"" + look);
  }
  /// `look`: further attributes.
  void AddText(std::string_view text, double x, double y, Align align, const std::string& look) {
    Open("text", {{"x", x}, {"y", y}});
    const char* anchor = align == Align::kMiddle ? " text-anchor=\"middle\"" : " text-anchor=\"end\"";
    text_ += (align == Align::kStart ? "" : anchor) + look + ">" + EscapedXml(text) + "</text>\n";
  }

  static std::string Number(double value) { return FormatFixed(value, 2); }
  static std::string Attributes(const Stroke& stroke) {
    std::string text =
        " fill=\"none\" stroke=\"" + std::string(stroke.color) + "\" stroke-width=\"" + Number(stroke.width) + "\"";
    if (!stroke.dash.empty()) text += " stroke-dasharray=\"" + std::string(stroke.dash) + "\"";
    return text;
  }
  const std::string& text() const { return text_; }

 private:
  void Open(const char* element, std::initializer_list<std::pair<const char*, double>> numbers) {
    text_ += std::string("<") + element;
    for (const auto& [name, value] : numbers) text_ += std::string(" ") + name + "=\"" + Number(value) + "\"";
  }
  void Finish(const std::string& attributes) { text_ += attributes + "/>\n"; }
  static std::string Text(const Points& points) {
    std::string text;
    for (const auto& [x, y] : points) text += (text.empty() ? "" : " ") + Number(x) + "," + Number(y);
    return text;
  }

  std::string text_;
};

// Returns the line of a series. Series with the same colour have different dashes.
Stroke LineOf(std::size_t entry) {
  return {kColors[entry % kColors.size()], kThick, kDashes[(entry + entry / kColors.size()) % kDashes.size()]};
}

class Drawing {
 public:
  /// Draws the whole figure starting at the upper left corner; returns its height.
  double DrawPlot(const Plot& plot);
  const std::string& text() const { return svg_.text(); }

 private:
  /// Draws a panel. `frame.height` is the height of the title, equal for adjacent panels. Returns the y coordinate
  /// below.
  double DrawPanel(const PlotPanel& panel, const Frame& frame);
  void DrawAxes(const PlotPanel& panel, const Frame& plane);
  void DrawHorizontalAxis(const PlotAxis& axis, const Frame& plane);
  void DrawVerticalAxis(const PlotAxis& axis, const Frame& plane);
  void DrawSteps(const PlotPanel& panel, const PlotSeries& series, const Frame& plane);
  void DrawPoints(const PlotPanel& panel, const PlotSeries& series, const Frame& plane);
  double DrawLegend(const Plot& plot, double top);
  void DrawMark(std::size_t entry, double x, double y, double opacity = 1.0);
  void Text(std::string_view text, double x, double y, Align align = Align::kStart, std::string_view color = kInk);
  /// Draws wrapped text; returns the y coordinate below.
  double Paragraph(const std::string& text, const Frame& frame, double font, std::string_view color);

  SvgBody svg_;
};

void Drawing::Text(std::string_view text, double x, double y, Align align, std::string_view color) {
  svg_.AddText(text, x, y, align, color == kInk ? "" : " fill=\"" + std::string(color) + "\"");
}

double Drawing::Paragraph(const std::string& text, const Frame& frame, double font, std::string_view color) {
  std::string look = color == kInk ? "" : " fill=\"" + std::string(color) + "\"";
  if (font != kFont) look += " font-size=\"" + SvgBody::Number(font) + "\"";
  double y = frame.top;
  for (const std::string& line : WrappedText(text, frame.width, font)) {
    y += kLine;
    svg_.AddText(line, frame.left, y, Align::kStart, look);
  }
  return y;
}

// Returns the common height of the titles of panel `first` and the next.
double TitleHeight(const Plot& plot, std::size_t first, double width) {
  std::size_t lines = 0;
  for (std::size_t i = first; i < std::min(first + 2, plot.panels.size()); ++i) {
    lines = std::max(lines, WrappedText(plot.panels[i].title, width, kTitleFont).size());
  }
  return kLine * static_cast<double>(lines);
}

// Shapes as on the page: disc, square, triangle, diamond, then the same shapes hollow.
void Drawing::DrawMark(std::size_t entry, double x, double y, double opacity) {
  constexpr std::size_t kShapes = 4;
  const bool hollow = entry / kShapes % 2 == 1;
  const std::string_view color = kColors[entry % kColors.size()];
  std::string look = hollow ? SvgBody::Attributes({color, 1.0}) : " fill=\"" + std::string(color) + "\"";
  if (opacity < 1.0) look += " opacity=\"" + SvgBody::Number(opacity) + "\"";
  switch (entry % kShapes) {
    case 0:
      svg_.Circle(x, y, kMark, look);
      break;
    case 1:
      svg_.Rectangle({x - kMark, y - kMark, 2.0 * kMark, 2.0 * kMark}, look);
      break;
    case 2:
      svg_.Polygon({{x, y - kMark}, {x + kMark, y + kMark}, {x - kMark, y + kMark}}, look);
      break;
    default:
      svg_.Polygon({{x, y - kMark}, {x + kMark, y}, {x, y + kMark}, {x - kMark, y}}, look);
  }
}

void Drawing::DrawHorizontalAxis(const PlotAxis& axis, const Frame& plane) {
  constexpr int kMost = 7;
  constexpr double kBeyond = 6.0;
  const double bottom = plane.top + plane.height;
  for (const PlotTick& tick : TicksOf(axis, kMost)) {
    const double x = Across(axis, tick.value, plane);
    svg_.Line(x, plane.top, x, bottom, {kGrid});
    Text(tick.label, x, bottom + kLine, Align::kMiddle);
  }
  if (axis.rim) {
    const double x = plane.left + plane.width - kRim;
    svg_.Line(x, plane.top, x, bottom, {kFaint});
    Text("failed", plane.left + plane.width + kBeyond, bottom + kLine, Align::kEnd, kFaint);
  }
  Text(axis.title, plane.left + kHalf * plane.width, bottom + 2.0 * kLine, Align::kMiddle);
}

void Drawing::DrawVerticalAxis(const PlotAxis& axis, const Frame& plane) {
  constexpr int kMost = 6;
  constexpr double kApart = 5.0, kDrop = 3.0;
  for (const PlotTick& tick : TicksOf(axis, kMost)) {
    const double y = Down(axis, tick.value, plane);
    svg_.Line(plane.left, y, plane.left + plane.width, y, {kGrid});
    Text(tick.label, plane.left - kApart, y + kDrop, Align::kEnd);
  }
  if (axis.rim) {
    svg_.Line(plane.left, plane.top + kRim, plane.left + plane.width, plane.top + kRim, {kFaint});
    Text("failed", plane.left - kApart, plane.top + kHalf * kRim + kDrop, Align::kEnd, kFaint);
  }
  const double x = plane.left - kLeftLabels + kApart - 2.0, y = plane.top + kHalf * plane.height;
  svg_.AddText(axis.title, x, y, Align::kMiddle,
               " transform=\"rotate(-90 " + SvgBody::Number(x) + " " + SvgBody::Number(y) + ")\"");
}

void Drawing::DrawAxes(const PlotPanel& panel, const Frame& plane) {
  DrawHorizontalAxis(panel.x, plane);
  DrawVerticalAxis(panel.y, plane);
  svg_.Rectangle(plane, SvgBody::Attributes({kFaint}));
  if (panel.kind != PlotKind::kPoints) return;
  const double from = std::max(panel.x.from, panel.y.from), to = std::min(panel.x.to, panel.y.to);
  svg_.Line(Across(panel.x, from, plane), Down(panel.y, from, plane), Across(panel.x, to, plane),
            Down(panel.y, to, plane), {kFaint});
}

void Drawing::DrawSteps(const PlotPanel& panel, const PlotSeries& series, const Frame& plane) {
  constexpr double kMarksApart = 90.0, kShift = 11.0;
  double y = Down(panel.y, 0.0, plane), x = plane.left;
  // Offset the marks of different series so that they do not overlap.
  double next = plane.left + std::fmod(kShift * static_cast<double>(series.entry) + kShift, kMarksApart);
  SvgBody::Points marks, curve{{x, y}};
  const auto across = [&](double to) {
    for (; next < to; next += kMarksApart) marks.emplace_back(next, y);
    x = to;
    curve.emplace_back(x, y);
  };
  for (const PlotPoint& step : series.points) {
    across(Across(panel.x, step.x, plane));
    y = Down(panel.y, step.y, plane);
    curve.emplace_back(x, y);
  }
  across(plane.left + plane.width);
  svg_.Polyline(curve, LineOf(series.entry));
  for (const auto& [at, level] : marks) DrawMark(series.entry, at, level);
}

void Drawing::DrawPoints(const PlotPanel& panel, const PlotSeries& series, const Frame& plane) {
  constexpr double kSeeThrough = 0.55;
  for (const PlotPoint& point : series.points) {
    DrawMark(series.entry, Across(panel.x, point.x, plane), Down(panel.y, point.y, plane), kSeeThrough);
  }
}

double Drawing::DrawPanel(const PlotPanel& panel, const Frame& frame) {
  Paragraph(panel.title, frame, kTitleFont, kInk);
  const Frame plane{frame.left + kLeftLabels, frame.top + frame.height + kLine, frame.width - kLeftLabels,
                    kPlaneHeight};
  DrawAxes(panel, plane);
  for (const PlotSeries& series : panel.series) {
    if (panel.kind == PlotKind::kSteps) {
      DrawSteps(panel, series, plane);
    } else {
      DrawPoints(panel, series, plane);
    }
  }
  double below = plane.top + plane.height + 2.0 * kLine;
  for (const std::string& note : panel.notes) {
    below = Paragraph(note, {plane.left, below, plane.width, 0.0}, kFont, kFaint);
  }
  return below;
}

// Draws the names in three columns.
double Drawing::DrawLegend(const Plot& plot, double top) {
  constexpr int kColumns = 3;
  constexpr double kSample = 30.0, kApart = 6.0, kLift = 3.0;
  const double width = (kFigureWidth - 2.0 * kMargin) / kColumns;
  for (std::size_t entry = 0; entry < plot.entries.size(); ++entry) {
    const double left = kMargin + width * static_cast<double>(entry % kColumns);
    if (entry % kColumns == 0) top += kLine + kLift;
    svg_.Line(left, top - kLift, left + kSample, top - kLift, LineOf(entry));
    DrawMark(entry, left + kHalf * kSample, top - kLift);
    Text(plot.entries[entry], left + kSample + kApart, top);
  }
  return top;
}

double Drawing::DrawPlot(const Plot& plot) {
  const double width = kHalf * (kFigureWidth - 2.0 * kMargin - kGap);
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
  return Paragraph(plot.caption, {kMargin, bottom, kFigureWidth - 2.0 * kMargin, 0.0}, kFont, kFaint) + kMargin;
}

}  // namespace

std::string RenderPlotSvg(const Plot& plot) {
  if (plot.panels.size() > kMaxPanels) {
    throw ClientError(ExitCode::kUsage,
                      std::to_string(plot.panels.size()) + " panels are too many for one figure (at most " +
                          std::to_string(kMaxPanels) + "); choose some by --methods, --tasks or --initializations");
  }
  Drawing drawing;
  const std::string height = SvgBody::Number(drawing.DrawPlot(plot));
  const std::string width = FormatFixed(kFigureWidth, 0);
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + width +
         "pt\" height=\"" + height + "pt\" viewBox=\"0 0 " + width + " " + height +
         "\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n<g font-family=\"Helvetica, Arial, "
         "sans-serif\" "
         "font-size=\"" +
         FormatFixed(kFont, 0) + "\" fill=\"" + std::string(kInk) + "\">\n" + drawing.text() + "</g>\n</svg>\n";
}

}  // namespace legopt::client
