#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "legopt/geometry/mesh.h"
#include "legopt/geometry/triangle_bvh.h"
#include "legopt/geometry/triangle_depth.h"

namespace legopt {

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
  /// (triangle_depth.h), m; negative if none cross. ODE must not be asked for many contacts: its table for merging
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
