#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>

#include "legopt/geometry/exact_collision.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Number of configurations checked strictly between two consecutive waypoints: t = k / (steps + 1), k = 1 .. steps.
inline constexpr int kInterpolationSteps = 10;

/// Collisions between the waypoints of a motion under direct interpolation. Not part of the verdict: neither the paper
/// nor its evaluator checks it. NaN: not evaluated.
struct InterpolationScore {
  /// Value of a figure that was not computed.
  static constexpr double kNotEvaluated = std::numeric_limits<double>::quiet_NaN();

  double environment_depth_m = kNotEvaluated;  ///< maximum contact depth with the scene, >= 0
  double self_depth_m = kNotEvaluated;         ///< maximum contact depth of all colliding link pairs, >= 0
  double free_share = kNotEvaluated;           ///< share of transitions without a depth above kFreeDepth_m, 0 .. 1
};

/// Maximum depth of a collision-free transition, m: the judge's tolerance.
inline constexpr double kFreeDepth_m = 1e-3;

/// Returns a configuration as used by the judge's kinematics: joints clamped to their limits, unit quaternion.
Eigen::VectorXd ClampedConfiguration(const RobotModel& robot, const Eigen::VectorXd& waypoint);

/// Scores the transitions between all consecutive waypoints, with exact meshes, on the path of robot/interpolation.h.
/// Joints are clamped to their limits first, as for the verdict; quaternions may have any non-zero norm. `kinematics`
/// and `collision` are workspaces of the robot. Evaluates nothing if there are fewer than two waypoints, or if one is
/// not n + 7 finite numbers of reasonable size with a non-zero quaternion.
InterpolationScore ScoreInterpolation(std::span<const Eigen::VectorXd> waypoints, Kinematics& kinematics,
                                      ExactCollision& collision);

}  // namespace legopt
