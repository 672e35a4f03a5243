#include "client/plot/svg_canvas.h"

#include <array>

#include "client/plot/curve_look.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

std::string SvgNumber(double value) { return FormatFixed(value, 2); }

// Returns e.g. "#0072b2".
std::string Hex(const Color& color) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  constexpr unsigned kBits = 4, kLow = 0xF;
  std::string text = "#";
  for (const unsigned part : {color.red, color.green, color.blue}) {
    text += kDigits[part >> kBits];
    text += kDigits[part & kLow];
  }
  return text;
}

std::string Attributes(const Stroke& stroke) {
  std::string text = " stroke=\"" + Hex(stroke.color) + "\" stroke-width=\"" + SvgNumber(stroke.width) + "\"";
  if (stroke.dash.empty()) return text;
  text += " stroke-dasharray=\"";
  for (std::size_t i = 0; i < stroke.dash.size(); ++i) text += (i == 0 ? "" : " ") + SvgNumber(stroke.dash[i]);
  return text + "\"";
}

std::string Attributes(const AreaLook& look) {
  std::string text = " fill=\"" + (look.fill ? Hex(*look.fill) : std::string("none")) + "\"";
  if (look.outline) text += Attributes(*look.outline);
  if (look.opacity < 1.0) text += " opacity=\"" + SvgNumber(look.opacity) + "\"";
  return text;
}

std::string PointsAttribute(const std::vector<CanvasPoint>& points) {
  std::string text = " points=\"";
  for (std::size_t i = 0; i < points.size(); ++i) {
    text += (i == 0 ? "" : " ") + SvgNumber(points[i].first) + "," + SvgNumber(points[i].second);
  }
  return text + "\"";
}

std::string EscapedXml(std::string_view text) {
  std::string escaped;
  for (const char c : text) {
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

}  // namespace

SvgCanvas::SvgCanvas(double width, double height, double font_size) : font_size_(font_size) {
  const std::string across = FormatGeneral(width), down = SvgNumber(height);
  text_ = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + across +
          "pt\" height=\"" + down + "pt\" viewBox=\"0 0 " + across + " " + down +
          "\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n<g font-family=\"Helvetica, Arial, "
          "sans-serif\" font-size=\"" +
          FormatGeneral(font_size) + "\" fill=\"" + Hex(kInk) + "\">\n";
}

void SvgCanvas::Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) {
  Open("line", {{"x1", from.first}, {"y1", from.second}, {"x2", to.first}, {"y2", to.second}});
  Close(Attributes(stroke));
}

void SvgCanvas::Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) {
  Open("polyline", {});
  Close(PointsAttribute(points) + " fill=\"none\"" + Attributes(stroke));
}

void SvgCanvas::Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) {
  Open("polygon", {});
  Close(PointsAttribute(corners) + Attributes(look));
}

void SvgCanvas::Box(const Rectangle& box, const AreaLook& look) {
  Open("rect", {{"x", box.left}, {"y", box.top}, {"width", box.width}, {"height", box.height}});
  Close(Attributes(look));
}

void SvgCanvas::Circle(CanvasPoint center, double radius, const AreaLook& look) {
  Open("circle", {{"cx", center.first}, {"cy", center.second}, {"r", radius}});
  Close(Attributes(look));
}

void SvgCanvas::Text(std::string_view text, CanvasPoint at, const TextLook& look) {
  constexpr std::array<const char*, 3> kAnchors = {"", " text-anchor=\"middle\"", " text-anchor=\"end\""};
  Open("text", {{"x", at.first}, {"y", at.second}});
  text_ += kAnchors.at(static_cast<std::size_t>(look.align));
  if (Hex(look.color) != Hex(kInk)) text_ += " fill=\"" + Hex(look.color) + "\"";
  if (look.size != font_size_) text_ += " font-size=\"" + SvgNumber(look.size) + "\"";
  if (look.upwards) text_ += " transform=\"rotate(-90 " + SvgNumber(at.first) + " " + SvgNumber(at.second) + ")\"";
  text_ += ">" + EscapedXml(text) + "</text>\n";
}

std::string SvgCanvas::Finish() { return std::move(text_) + "</g>\n</svg>\n"; }

void SvgCanvas::Open(const char* element, std::initializer_list<std::pair<const char*, double>> numbers) {
  text_ += std::string("<") + element;
  for (const auto& [name, value] : numbers) text_ += std::string(" ") + name + "=\"" + SvgNumber(value) + "\"";
}

void SvgCanvas::Close(const std::string& attributes) { text_ += attributes + "/>\n"; }

}  // namespace legopt::client
