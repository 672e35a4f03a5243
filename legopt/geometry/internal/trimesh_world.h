#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "legopt/geometry/internal/mesh.h"
#include "legopt/geometry/internal/triangle_bvh.h"

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
/// relative to mesh A. `bvh_a`, `bvh_b`: the trees of `a` and `b`. Unlike ODE, it considers all pairs and merges no
/// contacts.
double MeshDepth(const TriangleMesh& a, const TriangleBvh& bvh_a, const TriangleMesh& b, const TriangleBvh& bvh_b,
                 const Eigen::Isometry3d& X_AB);

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

/// The judge's interface to ODE: triangle meshes only, as in the original evaluator. ODE's types do not appear here.
/// Not thread-safe; worlds of different threads block each other in Depth and AllDepths.
class TrimeshWorld {
 public:
  /// Maximum number of contacts of two meshes in the original evaluator, in the order in which ODE finds them.
  static constexpr int kOriginalContacts = 255;
  /// Largest contact depths of two meshes, m; negative if they do not touch.
  struct Depths {
    double original_m = -1.0;  ///< over the first kOriginalContacts contacts
    double all_m = -1.0;       ///< over all contacts, >= original_m
  };

  TrimeshWorld();
  ~TrimeshWorld();
  TrimeshWorld(const TrimeshWorld&) = delete;
  TrimeshWorld& operator=(const TrimeshWorld&) = delete;

  /// Adds a mesh with at least one triangle; ODE gets its triangles in their order. Returns its index, starting at 0.
  int Add(TriangleMesh triangles);
  /// Sets the pose of a mesh in the world; initially the identity.
  void SetPose(int mesh, const Eigen::Isometry3d& pose);
  /// Returns the largest contact depth of two meshes by the original evaluator's rule, Depths::original_m. Uses
  /// ExactDepth if ODE fails or a mesh is a single triangle, which ODE cannot collide.
  double Depth(int mesh_a, int mesh_b);
  /// Returns both depths. Checks all pairs of triangles (ExactDepth) only if there are kOriginalContacts contacts or
  /// more, or if ODE cannot answer; in the latter case both are the exact depth.
  Depths AllDepths(int mesh_a, int mesh_b);
  /// Returns the largest depth of all crossing triangles of two meshes by ODE's rule, but without ODE
  /// (trimesh_world.h), m; negative if none cross. ODE must not be asked for many contacts: its table for merging
  /// coincident contacts aborts the program on overflow.
  double ExactDepth(int mesh_a, int mesh_b) const;

  /// Number of calls of Depth and AllDepths in which ODE failed an assertion (OdeFailure) and ExactDepth was used.
  std::int64_t ode_failures() const;

  /// Returns the DeepestCrossing of two meshes in this order, with its points in the world.
  MeshCrossing Crossing(int mesh_a, int mesh_b) const;

  const TriangleMesh& triangles(int mesh) const;  ///< returns the triangles of a mesh
  const TriangleBvh& bvh(int mesh) const;         ///< returns the tree of a mesh's triangles

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
