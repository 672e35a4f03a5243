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
  /// Contacts of a pair of meshes that the original evaluator looks at, in the order in which ODE finds them.
  static constexpr int kOriginalContacts = 255;
  /// The most that ODE can be asked for.
  static constexpr int kAllContacts = 0xffff;

  /// Largest contact depth of two meshes, m; negative when they do not touch.
  struct Depths {
    double original_m = -1.0;  ///< of the first kOriginalContacts contacts
    double all_m = -1.0;       ///< of up to kAllContacts, >= original_m
  };

  TrimeshWorld();
  ~TrimeshWorld();
  TrimeshWorld(const TrimeshWorld&) = delete;
  TrimeshWorld& operator=(const TrimeshWorld&) = delete;

  /// Takes a mesh with at least one triangle; triangles are handed to ODE in their order. Returns its number, 0, 1, ...
  int Add(const TriangleMesh& mesh);
  /// Owner's pose in the world; identity at first.
  void SetPose(int mesh, const Eigen::Isometry3d& pose);
  /// Largest depth of the contacts between two meshes, as the original evaluator has it: Depths::original_m.
  double Depth(int mesh_a, int mesh_b);
  /// Both depths. Asks ODE a second time only when there are as many contacts as the original looks at.
  Depths AllDepths(int mesh_a, int mesh_b);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace legopt
