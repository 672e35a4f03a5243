#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "legopt/collision/mesh.h"

namespace legopt::generate {

using Colour = std::array<std::uint8_t, 3>;

/// What is drawn: triangles with a colour and a part number each; edges between parts are drawn as thin lines.
struct Drawing {
  TriangleMesh mesh;
  std::vector<Colour> colours;  ///< by triangle
  std::vector<int> parts;       ///< by triangle
};

/// Where from. Metres, world frame, z up.
struct Camera {
  Eigen::Vector3d eye = {-10.0, -10.0, 8.0};
  Eigen::Vector3d target = {0.0, 0.0, 0.0};
  double field_of_view_rad = 0.7;  ///< vertical
  int width = 1280;
  int height = 800;
  double cut_m = 1e9;  ///< what lies higher is not drawn, so that one sees into a building
};

/// A picture in memory, rows from the top, RGB.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Draws with a depth buffer, flat shading, a sun that casts shadows, and 2 x 2 samples per pixel. No display needed.
Picture Render(const Drawing& drawing, const Camera& camera);

/// Writes a PNG (libpng). Throws InputError when the file cannot be written.
void WritePng(const std::filesystem::path& path, const Picture& picture);

}  // namespace legopt::generate
