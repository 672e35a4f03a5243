#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <vector>

#include "legopt/collision/mesh.h"
#include "legopt/collision/triangle_bvh.h"
#include "legopt/collision/triangle_depth.h"

namespace legopt {

/// The judge's side of ODE: triangle meshes only, as the original evaluator used them. ODE's types do not appear here.
/// One thread at a time; worlds of different threads wait for each other in Depth and AllDepths.
class TrimeshWorld {
 public:
  /// Contacts of a pair of meshes that the original evaluator looks at, in the order in which ODE finds them.
  static constexpr int kOriginalContacts = 255;
  /// Largest contact depth of two meshes, m; negative when they do not touch.
  struct Depths {
    double original_m = -1.0;  ///< of the first kOriginalContacts contacts
    double all_m = -1.0;       ///< of all, >= original_m
  };

  TrimeshWorld();
  ~TrimeshWorld();
  TrimeshWorld(const TrimeshWorld&) = delete;
  TrimeshWorld& operator=(const TrimeshWorld&) = delete;

  /// Takes a mesh with at least one triangle; its triangles are handed to ODE in their order. Returns its number, 0, 1,
  /// ...
  int Add(TriangleMesh triangles);
  /// Owner's pose in the world; identity at first.
  void SetPose(int mesh, const Eigen::Isometry3d& pose);
  /// Largest depth of the contacts between two meshes, as the original evaluator has it: Depths::original_m. ExactDepth
  /// where ODE fails or a mesh is a single triangle, which ODE cannot collide.
  double Depth(int mesh_a, int mesh_b);
  /// Both depths. Looks at all pairs of triangles (ExactDepth) only when there are as many contacts as the original
  /// looks at, or when ODE cannot answer; then both are the exact depth.
  Depths AllDepths(int mesh_a, int mesh_b);
  /// Largest depth of all crossing triangles of two meshes by ODE's rule but not by ODE (triangle_depth.h), m; negative
  /// when none cross. ODE itself is not to be asked for many contacts: its store of contacts, by which it merges those
  /// that coincide, ends the program when it runs over.
  double ExactDepth(int mesh_a, int mesh_b) const;

  /// Number of calls of Depth and AllDepths in which ODE failed an assertion (OdeFailure) and ExactDepth answered.
  std::int64_t ode_failures() const;

  /// Where that depth is: DeepestCrossing with its points in the world, of these two meshes in this order.
  MeshCrossing Crossing(int mesh_a, int mesh_b) const;

  const TriangleMesh& triangles(int mesh) const;  ///< as given to Add
  const TriangleBvh& bvh(int mesh) const;         ///< of these triangles

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
