#pragma once

#include <vector>

#include "legopt/collision/closed_bodies.h"
#include "legopt/collision/convex_shape.h"
#include "legopt/collision/culling.h"
#include "legopt/collision/trimesh_world.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// The exact triangle meshes of a robot's links inside a TrimeshWorld, with their hulls to tell early that two meshes
/// cannot touch.
class LinkTrimeshes {
 public:
  /// One geometry of a link.
  struct Geometry {
    int link;                    ///< that it belongs to
    int mesh;                    ///< number within the TrimeshWorld
    ConvexShape hull;            ///< of the mesh, link frame
    ClosedBodies bodies;         ///< of the mesh, link frame
    Eigen::Isometry3d pose;      ///< of the link in the world
    PointArena::Range range;     ///< of the hull's points
    SupportSet placed;           ///< the hull in the world
    Eigen::AlignedBox3d bounds;  ///< of the hull in the world
  };

  /// Loads every geometry. `world` must outlive this object. Throws InputError.
  LinkTrimeshes(const RobotModel& robot, TrimeshWorld& world, Culling culling = Culling::kOn);
  LinkTrimeshes(const LinkTrimeshes&) = delete;
  LinkTrimeshes& operator=(const LinkTrimeshes&) = delete;

  /// Moves all geometries to the poses held by `kinematics`.
  void Place(const Kinematics& kinematics);

  /// Of a link; 0 when it touches nothing.
  int num_geometries(int link) const { return static_cast<int>(by_link_[static_cast<size_t>(link)].size()); }
  /// One of them, in the order of the URDF; as placed by the last Place().
  const Geometry& geometry(int link, int index) const {
    return geometries_[static_cast<size_t>(by_link_[static_cast<size_t>(link)][static_cast<size_t>(index)])];
  }

  /// Largest contact depth of two placed geometries of different links as the original evaluator has it, m; negative
  /// when they do not touch.
  double Depth(const Geometry& a, const Geometry& b) const;
  /// The same, and that of all contacts.
  TrimeshWorld::Depths AllDepths(const Geometry& a, const Geometry& b) const;

  /// Of all crossing triangles, whatever ODE's limits (TrimeshWorld::ExactDepth).
  double ExactDepth(const Geometry& a, const Geometry& b) const;

  /// How deep the deepest vertex of two placed geometries lies inside a closed body of the other, m; 0 when none does.
  double InsideDepth(const Geometry& a, const Geometry& b) const;

  /// Of the exact mesh of a geometry, link frame, m.
  const std::vector<Eigen::Vector3d>& vertices(const Geometry& geometry) const {
    return world_.triangles(geometry.mesh).vertices;
  }

  /// True when the hulls of two placed geometries overlap by more than `depth_m`.
  bool HullsOverlap(const Geometry& a, const Geometry& b, double depth_m) const;

  /// Distance between hulls up to which meshes are handed to ODE: covers ODE's single-precision pair search, m.
  static constexpr double kSafety = 1e-4;

 private:
  bool MayTouch(const Geometry& a, const Geometry& b) const;
  double DeepestVertex(const Geometry& geometry, const Geometry& other) const;

  TrimeshWorld& world_;
  Culling culling_;
  std::vector<Geometry> geometries_;
  std::vector<std::vector<int>> by_link_;
  PointArena local_;
  PointArena placed_;
};

}  // namespace legopt
