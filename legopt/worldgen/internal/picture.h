#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "legopt/geometry/internal/mesh.h"

namespace legopt::worldgen {

/// Red, green, blue.
using Colour = std::array<std::uint8_t, 3>;

/// Triangles to draw, each with a colour and a part number; edges between parts are drawn as thin lines.
struct Drawing {
  TriangleMesh mesh;            ///< world frame, m
  std::vector<Colour> colours;  ///< per triangle
  std::vector<int> parts;       ///< per triangle
};

/// Camera of a picture, in the world frame (m, z up).
struct Camera {
  Eigen::Vector3d eye = {-10.0, -10.0, 8.0};
  Eigen::Vector3d target = {0.0, 0.0, 0.0};  ///< point at the centre of the picture
  double field_of_view_rad = 0.7;            ///< vertical
  int width = 1280;                          ///< pixels
  int height = 800;                          ///< pixels
  int shadow_size = 3000;                    ///< samples of the shadows along each axis
  double cut_m = 1e9;                        ///< parts above this height are not drawn, which shows the inside of a
                                             ///< building
};

/// An RGB picture in memory, rows from the top.
struct Picture {
  int width = 0;                  ///< pixels
  int height = 0;                 ///< pixels
  std::vector<std::uint8_t> rgb;  ///< 3 x width x height bytes
};

/// Renders with a depth buffer, flat shading, a sun that casts shadows, and 2 x 2 samples per pixel. Needs no display.
Picture Render(const Drawing& drawing, const Camera& camera);

/// Joins two pictures of equal height, `left` on the left.
Picture Beside(const Picture& left, const Picture& right);

/// Writes a PNG (libpng). Throws InputError if the file cannot be written.
void WritePng(const std::filesystem::path& path, const Picture& picture);

}  // namespace legopt::worldgen
