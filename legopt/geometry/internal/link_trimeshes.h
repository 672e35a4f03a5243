#pragma once

#include <memory>
#include <vector>

#include "legopt/geometry/internal/convex_shape.h"
#include "legopt/geometry/internal/exact_collision.h"
#include "legopt/geometry/internal/mesh_bodies.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/geometry/internal/trimesh_world.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// The closed bodies of a mesh, found when they are first needed: the bodies of most links never are. Not thread-safe.
class LazyBodies {
 public:
  /// `mesh` must outlive this object.
  explicit LazyBodies(const TriangleMesh& mesh) : mesh_(&mesh) {}
  const ClosedBodies* operator->() const {
    if (!bodies_) bodies_ = std::make_shared<const ClosedBodies>(*mesh_);
    return bodies_.get();
  }

 private:
  const TriangleMesh* mesh_;
  mutable std::shared_ptr<const ClosedBodies> bodies_;
};

/// One vertex of each connected component of a mesh, found when they are first needed. Not thread-safe.
class LazyRepresentatives {
 public:
  /// `mesh` must outlive this object.
  explicit LazyRepresentatives(const TriangleMesh& mesh) : mesh_(&mesh) {}
  const std::vector<Eigen::Vector3d>& get() const;

 private:
  const TriangleMesh* mesh_;
  mutable std::vector<Eigen::Vector3d> vertices_;
};

/// The exact triangle meshes of a robot's links in a TrimeshWorld, with their hulls for culling.
class LinkTrimeshes {
 public:
  /// One geometry of a link.
  struct Geometry {
    int link;
    int mesh;                             ///< index in the TrimeshWorld
    ConvexShape hull;                     ///< hull of the mesh, link frame
    LazyBodies bodies;                    ///< closed bodies of the mesh, link frame
    LazyRepresentatives representatives;  ///< one vertex per component of the mesh, link frame
    Eigen::Isometry3d pose;               ///< link frame in the world
    PointArena::Range range;              ///< range of the hull's points
    SupportSet placed;                    ///< hull in the world
    Eigen::AlignedBox3d bounds;           ///< bounding box of the hull in the world
  };

  /// Loads every geometry. `world` must outlive this object. Throws InputError.
  LinkTrimeshes(const RobotModel& robot, TrimeshWorld& world, Culling culling = Culling::kOn);
  LinkTrimeshes(const LinkTrimeshes&) = delete;
  LinkTrimeshes& operator=(const LinkTrimeshes&) = delete;

  /// Moves all geometries to the link poses of `kinematics`.
  void Place(const Kinematics& kinematics);
  /// Moves the geometries of one link; all others keep their poses.
  void Place(const Kinematics& kinematics, int link);

  /// Returns the number of geometries of a link; 0 if it cannot collide.
  int num_geometries(int link) const { return static_cast<int>(by_link_[static_cast<size_t>(link)].size()); }
  /// Returns a geometry of a link, in the order of the URDF, at the pose of the last Place().
  const Geometry& geometry(int link, int index) const {
    return geometries_[static_cast<size_t>(by_link_[static_cast<size_t>(link)][static_cast<size_t>(index)])];
  }

  /// Returns the largest contact depth of two geometries of different links by the original evaluator's rule, m;
  /// negative if they do not touch.
  double Depth(const Geometry& a, const Geometry& b) const;
  /// Returns the largest contact depth by the original evaluator's rule and that over all contacts.
  TrimeshWorld::Depths AllDepths(const Geometry& a, const Geometry& b) const;

  /// Returns the largest depth of all crossing triangles, independent of ODE's limits (TrimeshWorld::ExactDepth).
  double ExactDepth(const Geometry& a, const Geometry& b) const;

  /// Returns the depth of the deepest vertex of either geometry inside a closed body of the other, m; 0 if there is
  /// none.
  double InsideDepth(const Geometry& a, const Geometry& b) const;

  /// Returns true if ExactDepth or InsideDepth exceeds `depth_m`, m, >= 0. Faster than both: a component whose
  /// triangles cross no others has all or none of its vertices inside.
  bool Overlap(const Geometry& a, const Geometry& b, double depth_m) const;

  /// Returns the vertices of a geometry's exact mesh, link frame, m.
  const std::vector<Eigen::Vector3d>& vertices(const Geometry& geometry) const {
    return world_.triangles(geometry.mesh).vertices;
  }

  /// Returns true if the hulls of two geometries overlap by more than `depth_m`.
  bool HullsOverlap(const Geometry& a, const Geometry& b, double depth_m) const;

  /// Distance between hulls up to which ODE checks the meshes, m; covers the single precision of ODE's pair search.
  static constexpr double kSafety = 1e-4;

 private:
  bool MayTouch(const Geometry& a, const Geometry& b) const;
  /// Returns true, with the signed distance of the hulls, if it is below `distance_m`.
  static bool AreNear(const Geometry& a, const Geometry& b, double distance_m, PairDistance* hulls);
  double DeepestVertex(const Geometry& geometry, const std::vector<Eigen::Vector3d>& vertices, const Geometry& other,
                       const Eigen::Vector3d& to_geometry) const;

  TrimeshWorld& world_;
  Culling culling_;
  std::vector<Geometry> geometries_;
  std::vector<std::vector<int>> by_link_;
  PointArena local_;
  PointArena placed_;
};

}  // namespace legopt
