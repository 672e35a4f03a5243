#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "legopt/geometry/internal/mesh.h"

namespace legopt {

/// Heights over a rectangular grid.
struct HeightGrid {
  int columns = 0;                ///< along x
  int rows = 0;                   ///< along y; the first row is that with the largest y, as in a picture
  std::vector<double> heights_m;  ///< rows x columns, row by row; pictures: 0 (black) to 1 (white), not metres
};

/// Returns true for .png, .pgm, .txt and .csv, in upper or lower case.
bool IsHeightMapFile(const std::filesystem::path& path);

/// Returns true if the heights of such a file are metres: for .txt and .csv.
bool HasMetres(const std::filesystem::path& path);

/// Reads a grid: a PNG or PGM (P2, P5) picture with 8 or 16 bits, of which colours become grey, or text with one row
/// per line, whose numbers are separated by spaces, tabs, commas or semicolons; lines that begin with # are comments.
/// Reads in the calling thread; LoadMesh calls it under its guard. Throws InputError: a file that is none of these,
/// rows of different length, less than 2 x 2 or more than 2049 x 2049 values, a number that is not finite.
HeightGrid ReadHeightGrid(const std::string& path);

/// Returns the solid below a surface: the grid spans scale.x() by scale.y() metres about the origin, its heights are
/// multiplied by scale.z(), and a flat floor lies 0.5 m below the lowest height. Each cell is two triangles. Closed and
/// wound outwards.
TriangleMesh SolidBelow(const HeightGrid& grid, const Eigen::Vector3d& scale);

}  // namespace legopt
