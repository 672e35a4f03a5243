#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "legopt/robot/robot_model.h"
#include "legopt/types/read_guard.h"

namespace legopt {

/// Indexed triangles, counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;      ///< m
  std::vector<std::array<int, 3>> triangles;  ///< indices into `vertices`
  int degenerate_triangles = 0;               ///< number of triangles with equal corners that LoadMesh left out
};

/// Reads a mesh file (STL, OBJ, DAE, PLY, glTF, GLB or OFF, by content and suffix) in the frame and with the triangle
/// order of the file. A height map (height_map.h) gives the solid below it, with `scale` as its size.
///
/// `scale` multiplies each axis; an odd number of negative factors also reverses the winding, so that the outside is
/// preserved. Vertices with identical coordinates are welded; triangles with two equal corners are removed. DAE files:
/// lengths are converted to metres by the file's unit; axes are unchanged (mesh_file.h). assimp runs under
/// `guard`, with limits that depend on the file size, since malformed files may crash it or block it for ever. Prints
/// nothing. Thread-safe. Throws InputError: file missing, unreadable or of another format, no triangles, a coordinate
/// or scale that is not finite, no answer from the guard (crash, limit).
TriangleMesh LoadMesh(const std::string& path, const Eigen::Vector3d& scale = Eigen::Vector3d::Ones(),
                      const ReadGuard& guard = {});

/// Returns the triangles of any shape, in the frame of the shape's owner (`shape.pose` applied).
///
/// Curved surfaces are inscribed: all vertices lie on the surface, and no point lies outside the shape. For kMesh the
/// file is loaded under `guard`. Throws InputError for a size that is not positive and finite, and like LoadMesh.
TriangleMesh Tessellate(const ShapeSpec& shape, const ReadGuard& guard = {});

}  // namespace legopt
