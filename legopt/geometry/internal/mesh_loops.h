#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "legopt/geometry/internal/marked_mesh.h"

namespace legopt {

/// An open edge of a patch, in the direction in which its triangle uses it.
struct RimEdge {
  int from = 0;
  int to = 0;
  int triangle = 0;
};

/// A closed line of open edges, in the direction of a cap that closes it.
struct MeshLoop {
  std::vector<int> vertices;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit normal of the cap
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double area_m2 = 0.0;      ///< area within the loop, projected along the normal
  double deviation_m = 0.0;  ///< largest distance from the plane
  double diagonal_m = 0.0;   ///< diagonal of the bounding box
};

/// Returns the open edges of a patch, a list of triangles.
std::vector<RimEdge> RimOf(const MarkedMesh& mesh, const std::vector<int>& patch);

/// Returns the loops of a rim; a loop that touches itself is divided there. Empty if the rim has a loose end.
std::vector<std::vector<int>> TraceLoops(const std::vector<RimEdge>& rim);

/// Returns the loop through `vertices` with its plane and extents.
MeshLoop MeasureLoop(const MarkedMesh& mesh, std::vector<int> vertices);

/// Returns two unit vectors that span the plane with a normal, counter-clockwise about it.
std::pair<Eigen::Vector3d, Eigen::Vector3d> SpanOf(const Eigen::Vector3d& normal);

/// Returns the smallest loop around loop `inner` that lies in the same plane and has the opposite direction, or -1. The
/// inner loop of such a pair is the inner outline of a ring, such as the end of a pipe.
int SmallestAround(const MarkedMesh& mesh, const std::vector<MeshLoop>& loops, std::size_t inner, double tolerance_m);

}  // namespace legopt
