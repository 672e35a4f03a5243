#pragma once

#include <Eigen/Geometry>
#include <array>

#include "legopt/geometry/mesh.h"
#include "legopt/geometry/triangle_bvh.h"

namespace legopt {

/// Corners of a triangle, counter-clockwise seen from outside, m.
using TriangleCorners = std::array<Eigen::Vector3d, 3>;

/// Computes the depth of two crossing triangles by ODE's rule (docs/explanation/judge.md#contact-depth) in double
/// precision, m,
/// >= 0; negative if they do not cross.
///
/// Each triangle is clipped to the prism over the other; its depth is the largest distance of the remainder behind the
/// other's plane. The result is the smaller of the two depths. Coplanar triangles do not cross.
double TriangleDepth(const TriangleCorners& a, const TriangleCorners& b);

/// Returns the largest depth of all pairs of triangles of two meshes, m; negative if none cross. `X_AB`: pose of mesh B
/// in the frame of A. `bvh_a`: tree of `a`. Unlike ODE, it considers all pairs and merges no contacts.
double MeshDepth(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b, const Eigen::Isometry3d& X_AB);

/// Deepest crossing of two meshes.
struct MeshCrossing {
  double depth_m = -1.0;                              ///< depth as returned by MeshDepth; negative: no triangles cross
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on the crossing triangle of A, or on its plane
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< on the crossing triangle of B, or on its plane; `depth_m`
                                                      ///< from point_a
};

/// Returns the depth of MeshDepth with its two points: the deepest point of the triangle behind the other's plane, and
/// its projection onto that plane. Points in the frame of A, m.
MeshCrossing DeepestCrossing(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b,
                             const Eigen::Isometry3d& X_AB);

}  // namespace legopt
