#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace legopt::client {

/// Colour in sRGB.
struct Color {
  std::uint8_t red = 0, green = 0, blue = 0;
};

/// Look of a line; lengths in points of 1/72 inch.
struct Stroke {
  Color color;
  double width = 0.6;
  std::vector<double> dash = {};  ///< lengths of dashes and gaps; empty: solid
};

/// Look of an area.
struct AreaLook {
  std::optional<Color> fill = {};
  std::optional<Stroke> outline = {};
  double opacity = 1.0;  ///< (0, 1]
};

enum class Align { kStart, kMiddle, kEnd };

struct TextLook {
  Color color;
  double size = 9.0;
  Align align = Align::kStart;
  bool upwards = false;  ///< rotated by 90 degrees counter-clockwise
};

struct Rectangle {
  double left = 0.0, top = 0.0, width = 0.0, height = 0.0;
};

using CanvasPoint = std::pair<double, double>;  ///< x, y

/// A page of a file format, onto which a figure is drawn. Coordinates are points of 1/72 inch from the upper left
/// corner, x to the right and y down. Texts are UTF-8 without control characters. One thread at a time.
class Canvas {
 public:
  Canvas() = default;
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  virtual ~Canvas() = default;

  virtual void Line(CanvasPoint from, CanvasPoint to, const Stroke& stroke) = 0;
  virtual void Polyline(const std::vector<CanvasPoint>& points, const Stroke& stroke) = 0;
  virtual void Polygon(const std::vector<CanvasPoint>& corners, const AreaLook& look) = 0;
  virtual void Box(const Rectangle& box, const AreaLook& look) = 0;
  virtual void Circle(CanvasPoint center, double radius, const AreaLook& look) = 0;
  virtual void Text(std::string_view text, CanvasPoint at, const TextLook& look) = 0;

  /// Returns the bytes of the file. The canvas must not be used afterwards.
  virtual std::string Finish() = 0;
};

/// A canvas that draws nothing, to measure a figure.
class NoCanvas final : public Canvas {
 public:
  void Line(CanvasPoint, CanvasPoint, const Stroke&) override {}
  void Polyline(const std::vector<CanvasPoint>&, const Stroke&) override {}
  void Polygon(const std::vector<CanvasPoint>&, const AreaLook&) override {}
  void Box(const Rectangle&, const AreaLook&) override {}
  void Circle(CanvasPoint, double, const AreaLook&) override {}
  void Text(std::string_view, CanvasPoint, const TextLook&) override {}
  std::string Finish() override { return {}; }
};

}  // namespace legopt::client
