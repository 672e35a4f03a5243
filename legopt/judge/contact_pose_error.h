#pragma once

#include <Eigen/Geometry>

namespace legopt {

/// Largest component of a foot's pose error (docs/explanation/judge.md#foot-pose-error).
struct ContactPoseError {
  double violation = 0;  ///< quaternion component (1) or translation (m), >= 0; infinite for NaN
  int component = 0;     ///< 0..2: quaternion x y z, 3..5: translation x y z, in the target frame
};

/// Returns true if a value exceeds a tolerance. NaN counts as exceeding.
inline bool Exceeds(double value, double tolerance) { return !(value <= tolerance); }

/// Computes the largest component of the vector part of the quaternion and the translation of inverse(target) * actual.
/// Poses in the world.
ContactPoseError ComputeContactPoseError(const Eigen::Isometry3d& target, const Eigen::Isometry3d& actual);

}  // namespace legopt
