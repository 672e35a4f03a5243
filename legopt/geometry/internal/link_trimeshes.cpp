#include "legopt/geometry/internal/link_trimeshes.h"

#include <algorithm>

#include "legopt/geometry/internal/prepared_geometry.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/types/input_error.h"

namespace legopt {

LinkTrimeshes::LinkTrimeshes(const RobotModel& robot, TrimeshWorld& world, Culling culling)
    : world_(world), culling_(culling) {
  by_link_.resize(robot.links().size());
  for (size_t link = 0; link < robot.links().size(); ++link) {
    for (const ShapeSpec& spec : robot.links()[link].collision) {
      const int mesh = world_.Add(Tessellate(spec, robot.read_guard()));
      const TriangleMesh& triangles = world_.triangles(mesh);
      const ByteCache* cache = robot.read_guard().cache().get();
      Geometry geometry{.link = static_cast<int>(link),
                        .mesh = mesh,
                        .hull = ConvexShape::FromHull(PreparedHull(triangles.vertices, cache)),
                        .bodies = LazyBodies(triangles),
                        .pose = Eigen::Isometry3d::Identity(),
                        .range = {},
                        .placed = {},
                        .bounds = {}};
      geometry.range = local_.Add(geometry.hull.points());
      by_link_[link].push_back(static_cast<int>(geometries_.size()));
      geometries_.push_back(std::move(geometry));
    }
  }
  placed_.ResizeLike(local_);
  for (Geometry& geometry : geometries_) placed_.View(geometry.range, geometry.placed);
}

void LinkTrimeshes::Place(const Kinematics& kinematics) {
  for (Geometry& geometry : geometries_) {
    geometry.pose = kinematics.link_pose(geometry.link);
    PlaceSupportSet(geometry.hull, geometry.pose, geometry.placed);
    placed_.Transform(local_, geometry.range, geometry.pose, geometry.bounds.min(), geometry.bounds.max());
    world_.SetPose(geometry.mesh, geometry.pose);
  }
}

double LinkTrimeshes::Depth(const Geometry& a, const Geometry& b) const {
  constexpr double kNone = -1.0;
  return MayTouch(a, b) ? world_.Depth(a.mesh, b.mesh) : kNone;
}

TrimeshWorld::Depths LinkTrimeshes::AllDepths(const Geometry& a, const Geometry& b) const {
  return MayTouch(a, b) ? world_.AllDepths(a.mesh, b.mesh) : TrimeshWorld::Depths();
}

double LinkTrimeshes::ExactDepth(const Geometry& a, const Geometry& b) const {
  constexpr double kNone = -1.0;
  return MayTouch(a, b) ? world_.ExactDepth(a.mesh, b.mesh) : kNone;
}

/// Returns the depth of the deepest vertex of a geometry inside the bodies of another one.
double LinkTrimeshes::DeepestVertex(const Geometry& geometry, const Geometry& other) const {
  if (other.bodies->bodies().empty()) return 0.0;
  const Eigen::Isometry3d X_OG = other.pose.inverse(Eigen::Isometry) * geometry.pose;
  double deepest = 0.0;
  for (const Eigen::Vector3d& vertex : vertices(geometry)) {
    deepest = std::max(deepest, other.bodies->Depth(X_OG * vertex));
  }
  return deepest;
}

double LinkTrimeshes::InsideDepth(const Geometry& a, const Geometry& b) const {
  return MayTouch(a, b) ? std::max(DeepestVertex(a, b), DeepestVertex(b, a)) : 0.0;
}

bool LinkTrimeshes::MayTouch(const Geometry& a, const Geometry& b) const {
  return culling_ == Culling::kOff || HullsOverlap(a, b, -kSafety);
}

bool LinkTrimeshes::HullsOverlap(const Geometry& a, const Geometry& b, double depth_m) const {
  const double gap =
      std::max((a.bounds.min() - b.bounds.max()).maxCoeff(), (b.bounds.min() - a.bounds.max()).maxCoeff());
  PairDistance hulls;
  return gap < -depth_m && SignedDistance(a.placed, b.placed, -depth_m, hulls);
}

}  // namespace legopt
