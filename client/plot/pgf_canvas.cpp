#include "client/plot/pgf_canvas.h"

#include <array>

#include "client/report/escaped_text.h"
#include "legopt/types/number_text.h"

namespace legopt::client {
namespace {

std::string TexNumber(double value) { return FormatFixed(value, 2); }

std::string ColorText(const Color& color) {
  return "{rgb,255:red," + std::to_string(color.red) + ";green," + std::to_string(color.green) + ";blue," +
         std::to_string(color.blue) + "}";
}

std::string OptionsOf(const Stroke& stroke) {
  std::string options = "draw=" + ColorText(stroke.color) + ",line width=" + TexNumber(stroke.width) + "bp";
  if (stroke.dash.empty()) return options;
  options += ",dash pattern=";
  for (std::size_t i = 0; i < stroke.dash.size(); ++i) {
    options += (i % 2 == 0 ? "on " : " off ") + TexNumber(stroke.dash[i]) + "bp";
    if (i % 2 == 1 && i + 1 < stroke.dash.size()) options += " ";
  }
  return options;
}

std::string OptionsOf(const AreaLook& look) {
  std::string options;
  const auto add = [&](const std::string& option) { options += (options.empty() ? "" : ",") + option; };
  if (look.fill) add("fill=" + ColorText(*look.fill));
  if (look.outline) add(OptionsOf(*look.outline));
  if (look.opacity < 1.0) add("opacity=" + TexNumber(look.opacity));
  return options;
}

}  // namespace

PgfCanvas::PgfCanvas(double width, double height) : height_(height) {
  text_ = "% \\usepackage{tikz}\n\\begin{tikzpicture}[x=1bp,y=1bp]\n\\useasboundingbox (0,0) rectangle (" +
          TexNumber(width) + "," + TexNumber(height) + ");\n";
}

std::string PgfCanvas::Place(CanvasPoint point) const {
  return "(" + TexNumber(point.first) + "," + TexNumber(height_ - point.second) + ")";
}

void PgfCanvas::Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) { Polyline({from, to}, stroke); }

void PgfCanvas::Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) {
  text_ += "\\path[" + OptionsOf(stroke) + "] ";
  for (std::size_t i = 0; i < points.size(); ++i) text_ += (i == 0 ? "" : " -- ") + Place(points[i]);
  text_ += ";\n";
}

void PgfCanvas::Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) {
  text_ += "\\path[" + OptionsOf(look) + "] ";
  for (const CanvasPoint& corner : corners) text_ += Place(corner) + " -- ";
  text_ += "cycle;\n";
}

void PgfCanvas::Box(const Rectangle& box, const AreaLook& look) {
  text_ += "\\path[" + OptionsOf(look) + "] " + Place({box.left, box.top}) + " rectangle " +
           Place({box.left + box.width, box.top + box.height}) + ";\n";
}

void PgfCanvas::Circle(CanvasPoint center, double radius, const AreaLook& look) {
  text_ += "\\path[" + OptionsOf(look) + "] " + Place(center) + " circle (" + TexNumber(radius) + ");\n";
}

void PgfCanvas::Text(std::string_view text, CanvasPoint at, const TextLook& look) {
  constexpr std::array<const char*, 3> kAnchors = {"base west", "base", "base east"};
  constexpr double kLeading = 1.2;
  text_ += std::string("\\node[anchor=") + kAnchors.at(static_cast<std::size_t>(look.align)) + ",inner sep=0pt" +
           (look.upwards ? ",rotate=90" : "") + ",text=" + ColorText(look.color) + ",font=\\fontsize{" +
           TexNumber(look.size) + "}{" + TexNumber(kLeading * look.size) + "}\\selectfont] at " + Place(at) + " {" +
           LatexText(text) + "};\n";
}

std::string PgfCanvas::Finish() { return std::move(text_) + "\\end{tikzpicture}\n"; }

}  // namespace legopt::client
