#include "legopt/collision/link_trimeshes.h"

#include <algorithm>

#include "legopt/collision/signed_distance.h"
#include "legopt/input_error.h"

namespace legopt {

LinkTrimeshes::LinkTrimeshes(const RobotModel& robot, TrimeshWorld& world) : world_(world) {
  by_link_.resize(robot.links().size());
  for (size_t link = 0; link < robot.links().size(); ++link) {
    for (const ShapeSpec& spec : robot.links()[link].collision) {
      TriangleMesh mesh = Tessellate(spec, robot.read_guard());
      Geometry geometry{static_cast<int>(link), 0, ConvexShape::FromHull(ComputeHull(mesh.vertices)), {}, {}, {}};
      geometry.mesh = world_.Add(mesh);
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
    const Eigen::Isometry3d& pose = kinematics.link_pose(geometry.link);
    PlaceSupportSet(geometry.hull, pose, geometry.placed);
    placed_.Transform(local_, geometry.range, pose, geometry.bounds.min(), geometry.bounds.max());
    world_.SetPose(geometry.mesh, pose);
  }
}

double LinkTrimeshes::Depth(const Geometry& a, const Geometry& b) const {
  constexpr double kNone = -1.0;
  return HullsOverlap(a, b, -kSafety) ? world_.Depth(a.mesh, b.mesh) : kNone;
}

TrimeshWorld::Depths LinkTrimeshes::AllDepths(const Geometry& a, const Geometry& b) const {
  return HullsOverlap(a, b, -kSafety) ? world_.AllDepths(a.mesh, b.mesh) : TrimeshWorld::Depths();
}

bool LinkTrimeshes::HullsOverlap(const Geometry& a, const Geometry& b, double depth_m) const {
  const double gap =
      std::max((a.bounds.min() - b.bounds.max()).maxCoeff(), (b.bounds.min() - a.bounds.max()).maxCoeff());
  PairDistance hulls;
  return gap < -depth_m && SignedDistance(a.placed, b.placed, -depth_m, hulls);
}

}  // namespace legopt
