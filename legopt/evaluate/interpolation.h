#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>

#include "legopt/collision/exact_collision.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Configurations looked at strictly between two consecutive waypoints: t = k / (steps + 1), k = 1 .. steps.
inline constexpr int kInterpolationSteps = 10;

/// What happens between the waypoints of a motion when a robot just moves from each to the next. No part of the
/// verdict: neither the paper nor its evaluator looks there. NaN: not evaluated.
struct InterpolationScore {
  /// A figure that nobody has computed.
  static constexpr double kNotEvaluated = std::numeric_limits<double>::quiet_NaN();

  double environment_depth_m = kNotEvaluated;  ///< largest contact depth with the scene, >= 0
  double self_depth_m = kNotEvaluated;         ///< largest contact depth of all colliding link pairs, >= 0
  double free_share = kNotEvaluated;           ///< transitions without a depth above kFreeDepth_m / all, 0 .. 1
};

/// Depth up to which a transition counts as free, m: the judge's tolerance.
inline constexpr double kFreeDepth_m = 1e-3;

/// A configuration as the judge's kinematics see it: joints within their limits, unit quaternion.
Eigen::VectorXd ClampedConfiguration(const RobotModel& robot, const Eigen::VectorXd& waypoint);

/// Scores the transitions between all consecutive waypoints, with the exact meshes, on the path of
/// robot/interpolation.h. Joints are clamped to their limits first, as for the verdict; quaternions may have any
/// non-zero norm. `kinematics` and `collision` are workspaces of the robot. With less than two waypoints, or one that
/// is not n + 7 finite numbers of reasonable size with a quaternion of non-zero norm, nothing is evaluated.
InterpolationScore ScoreInterpolation(std::span<const Eigen::VectorXd> waypoints, Kinematics& kinematics,
                                      ExactCollision& collision);

}  // namespace legopt
