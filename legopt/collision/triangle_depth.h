#pragma once

#include <Eigen/Geometry>
#include <array>

#include "legopt/collision/mesh.h"
#include "legopt/collision/triangle_bvh.h"

namespace legopt {

/// Three corners, counter-clockwise seen from outside, m.
using TriangleCorners = std::array<Eigen::Vector3d, 3>;

/// Depth of two crossing triangles by ODE's rule (docs/readings.md#contact-depth), m, >= 0; negative when they do not
/// cross. In double precision.
///
/// Each is clipped to the prism over the other, and how far what is left reaches behind the other's plane is its depth;
/// that of the pair is the smaller one. Coplanar triangles do not cross.
double TriangleDepth(const TriangleCorners& a, const TriangleCorners& b);

/// The largest depth of all pairs of triangles of two meshes, m; negative when no two cross. `X_AB`: pose of mesh B in
/// the frame of A. All pairs, none merged, and none lost: the exact figure behind ODE's contacts. `bvh_a` is of `a`.
double MeshDepth(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b, const Eigen::Isometry3d& X_AB);

/// Where two meshes cross most deeply.
struct MeshCrossing {
  double depth_m = -1.0;                              ///< as of MeshDepth; negative: no two triangles cross
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< on the crossing triangle of A, or on its plane
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< likewise of B; `depth_m` away from point_a
};

/// The depth of MeshDepth with the points that are so far apart: of the triangle that reaches behind the other one its
/// deepest point, and that point's foot on the other's plane. Points in the frame of A, m.
MeshCrossing DeepestCrossing(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b,
                             const Eigen::Isometry3d& X_AB);

}  // namespace legopt
