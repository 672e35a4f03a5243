#pragma once

#include <Eigen/Geometry>

namespace legopt {

/// Largest component of a foot's pose error, and which one it is (docs/readings.md#foot-pose-error).
struct FootPoseError {
  double violation = 0;  ///< quaternion component (1) or translation (m), >= 0; infinite for NaN
  int component = 0;     ///< 0..2: quaternion x y z, 3..5: translation x y z, in the target frame
};

/// Whether a figure fails a tolerance; what is not a number does.
inline bool Exceeds(double value, double tolerance) { return !(value <= tolerance); }

/// Of the vector part of the quaternion and the translation of inverse(target) * actual. Poses in the world.
FootPoseError ErrorOfFootPose(const Eigen::Isometry3d& target, const Eigen::Isometry3d& actual);

}  // namespace legopt
