#include "legopt/geometry/internal/link_trimeshes.h"

#include <algorithm>
#include <limits>

#include "legopt/geometry/internal/prepared_geometry.h"
#include "legopt/geometry/internal/signed_distance.h"
#include "legopt/types/input_error.h"

namespace legopt {

const std::vector<Eigen::Vector3d>& LazyRepresentatives::get() const {
  if (vertices_.empty()) {
    for (const std::vector<int>& component : GroupTrianglesByComponent(*mesh_)) {
      const auto& triangle = mesh_->triangles[static_cast<size_t>(component.front())];
      vertices_.push_back(mesh_->vertices[static_cast<size_t>(triangle.front())]);
    }
  }
  return vertices_;
}

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
                        .representatives = LazyRepresentatives(triangles),
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
  for (size_t link = 0; link < by_link_.size(); ++link) Place(kinematics, static_cast<int>(link));
}

void LinkTrimeshes::Place(const Kinematics& kinematics, int link) {
  for (const int index : by_link_[static_cast<size_t>(link)]) {
    Geometry& geometry = geometries_[static_cast<size_t>(index)];
    geometry.pose = kinematics.link_pose(link);
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

/// Returns the depth of the deepest of a geometry's vertices inside the bodies of another one. `to_geometry`: unit
/// vector from the other hull to the geometry's, in the world, along which they overlap least: most vertices are
/// farther along it than all of the other hull, so that they are not inside.
double LinkTrimeshes::DeepestVertex(const Geometry& geometry, const std::vector<Eigen::Vector3d>& vertices,
                                    const Geometry& other, const Eigen::Vector3d& to_geometry) const {
  if (other.bodies->bodies().empty()) return 0.0;
  const Eigen::Isometry3d X_OG = other.pose.inverse(Eigen::Isometry) * geometry.pose;
  const Eigen::Vector3d direction = geometry.pose.linear().transpose() * to_geometry;
  const double end = other.placed.Farthest(to_geometry).dot(to_geometry) + other.placed.radius + kSafety -
                     geometry.pose.translation().dot(to_geometry);
  const double last = culling_ == Culling::kOn ? end : std::numeric_limits<double>::infinity();
  double deepest = 0.0;
  for (const Eigen::Vector3d& vertex : vertices) {
    if (direction.dot(vertex) > last) continue;
    deepest = std::max(deepest, other.bodies->Depth(X_OG * vertex));
  }
  return deepest;
}

double LinkTrimeshes::InsideDepth(const Geometry& a, const Geometry& b) const {
  PairDistance hulls;
  if (culling_ == Culling::kOn && !AreNear(a, b, kSafety, &hulls)) return 0.0;
  return std::max(DeepestVertex(a, vertices(a), b, hulls.normal), DeepestVertex(b, vertices(b), a, -hulls.normal));
}

bool LinkTrimeshes::Overlap(const Geometry& a, const Geometry& b, double depth_m) const {
  PairDistance hulls;
  if (culling_ == Culling::kOn && !AreNear(a, b, kSafety, &hulls)) return false;
  const double crossing_m = world_.ExactDepth(a.mesh, b.mesh);
  if (crossing_m > depth_m) return true;
  const auto exceeds = [&](const std::vector<Eigen::Vector3d>& of_a, const std::vector<Eigen::Vector3d>& of_b,
                           double limit_m) {
    return DeepestVertex(a, of_a, b, hulls.normal) > limit_m || DeepestVertex(b, of_b, a, -hulls.normal) > limit_m;
  };
  if (crossing_m < 0.0 && !exceeds(a.representatives.get(), b.representatives.get(), 0.0)) return false;
  return exceeds(vertices(a), vertices(b), depth_m);
}

bool LinkTrimeshes::MayTouch(const Geometry& a, const Geometry& b) const {
  return culling_ == Culling::kOff || HullsOverlap(a, b, -kSafety);
}

bool LinkTrimeshes::HullsOverlap(const Geometry& a, const Geometry& b, double depth_m) const {
  PairDistance hulls;
  return AreNear(a, b, -depth_m, &hulls);
}

bool LinkTrimeshes::AreNear(const Geometry& a, const Geometry& b, double distance_m, PairDistance* hulls) {
  const double gap =
      std::max((a.bounds.min() - b.bounds.max()).maxCoeff(), (b.bounds.min() - a.bounds.max()).maxCoeff());
  return gap < distance_m && SignedDistance(a.placed, b.placed, distance_m, *hulls);
}

}  // namespace legopt
