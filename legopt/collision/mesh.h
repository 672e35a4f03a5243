#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "legopt/read_guard.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Indexed triangles. Vertices in metres; a triangle's corners run counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Eigen::Vector3d> vertices;      ///< m
  std::vector<std::array<int, 3>> triangles;  ///< indices into `vertices`
};

/// Reads a mesh file (STL, OBJ, DAE or PLY, by content and suffix) in the frame and with the triangle order of the
/// file.
///
/// `scale` multiplies each axis; an odd number of negative factors also turns the winding round, so that outside stays
/// outside. Vertices with identical coordinates are welded; triangles with two equal corners after that are dropped.
/// DAE files: lengths are converted to metres by the file's unit; axes stay those of the file (collada_up_axis.h).
/// assimp runs under `guard`, with limits by the size of the file: damaged files crash it or keep it for ever. Prints
/// nothing. Thread-safe. Throws InputError: file missing, unreadable or of another format, no triangles, a coordinate
/// or scale that is not finite, a guard that gave no answer (crash, limit).
TriangleMesh LoadMesh(const std::string& path, const Eigen::Vector3d& scale = Eigen::Vector3d::Ones(),
                      const ReadGuard& guard = {});

/// Triangles of any shape, in the frame of the shape's owner (`shape.pose` applied).
///
/// Curved surfaces are inscribed: all vertices lie on the surface, no point lies outside of the shape. Kind kMesh loads
/// its file under `guard`. Throws InputError: a size that is not positive and finite, or whatever LoadMesh throws.
TriangleMesh Tessellate(const ShapeSpec& shape, const ReadGuard& guard = {});

}  // namespace legopt
