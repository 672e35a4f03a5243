#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// A ball. Lengths in metres.
struct Ball {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double radius_m = 0.0;
};

/// Returns the ball of a sphere, or those at both ends of a capsule, in the frame of the shape's owner moved by `pose`;
/// nothing for other shapes.
inline std::vector<Ball> BallsOf(const ShapeSpec& shape, const Eigen::Isometry3d& pose) {
  const auto at = [&](double z_m) {
    return Ball{.centre = pose * (shape.pose * Eigen::Vector3d(0.0, 0.0, z_m)), .radius_m = shape.size.x()};
  };
  if (shape.kind == ShapeSpec::Kind::kSphere) return {at(0.0)};
  if (shape.kind != ShapeSpec::Kind::kCapsule) return {};
  return {at(-0.5 * shape.size.z()), at(0.5 * shape.size.z())};
}

}  // namespace legopt
