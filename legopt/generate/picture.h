#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "legopt/collision/mesh.h"

namespace legopt::generate {

/// Red, green, blue.
using Colour = std::array<std::uint8_t, 3>;

/// What is drawn: triangles with a colour and a part number each; edges between parts are drawn as thin lines.
struct Drawing {
  TriangleMesh mesh;            ///< world frame, m
  std::vector<Colour> colours;  ///< by triangle
  std::vector<int> parts;       ///< by triangle
};

/// Where from. Metres, world frame, z up.
struct Camera {
  Eigen::Vector3d eye = {-10.0, -10.0, 8.0};  ///< where it stands
  Eigen::Vector3d target = {0.0, 0.0, 0.0};   ///< what it looks at, in the middle of the picture
  double field_of_view_rad = 0.7;             ///< vertical
  int width = 1280;                           ///< pixels
  int height = 800;                           ///< pixels
  double cut_m = 1e9;                         ///< what lies higher is not drawn, so that one sees into a building
};

/// A picture in memory, rows from the top, RGB.
struct Picture {
  int width = 0;                  ///< pixels
  int height = 0;                 ///< pixels
  std::vector<std::uint8_t> rgb;  ///< 3 x width x height bytes
};

/// Draws with a depth buffer, flat shading, a sun that casts shadows, and 2 x 2 samples per pixel. No display needed.
Picture Render(const Drawing& drawing, const Camera& camera);

/// Writes a PNG (libpng). Throws InputError when the file cannot be written.
void WritePng(const std::filesystem::path& path, const Picture& picture);

}  // namespace legopt::generate
