#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "legopt/collision/mesh.h"

namespace legopt {

/// The judge's side of ODE: triangle meshes only, as the original evaluator used them. ODE's types do not appear here.
/// One thread at a time.
class TrimeshWorld {
 public:
  /// Most contacts that count per pair of meshes (reference 6.1).
  static constexpr int kMaxContacts = 255;

  TrimeshWorld();
  ~TrimeshWorld();
  TrimeshWorld(const TrimeshWorld&) = delete;
  TrimeshWorld& operator=(const TrimeshWorld&) = delete;

  /// Takes a mesh with at least one triangle; triangles are handed to ODE in their order. Returns its number, 0, 1, ...
  int Add(TriangleMesh mesh);
  /// Owner's pose in the world; identity at first.
  void SetPose(int mesh, const Eigen::Isometry3d& pose);
  /// Largest depth of the contacts between two meshes [m]; negative when there is no contact.
  double Depth(int mesh_a, int mesh_b);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
