#include "legopt/judge/interpolation.h"

#include <algorithm>

#include "legopt/robot/configuration.h"
#include "legopt/robot/interpolation.h"

namespace legopt {
namespace {

// Beyond this, poses may overflow in kinematics; solver results are far below it.
constexpr double kLargestNumber = 1e6;

bool IsUsable(const RobotModel& robot, const Eigen::VectorXd& x) {
  return x.size() == robot.configuration_size() && x.allFinite() && x.cwiseAbs().maxCoeff() <= kLargestNumber &&
         PartsOf(x).quaternion_coefficients().stableNorm() > 0;
}

}  // namespace

Eigen::VectorXd ClampedConfiguration(const RobotModel& robot, const Eigen::VectorXd& waypoint) {
  Eigen::VectorXd x = waypoint;
  robot.ClampJoints(x);
  MutablePartsOf(x).quaternion_coefficients() = PartsOf(waypoint).quaternion_coefficients().stableNormalized();
  return x;
}

InterpolationScore ScoreInterpolation(std::span<const Eigen::VectorXd> waypoints, Kinematics& kinematics,
                                      ExactCollision& collision) {
  const RobotModel& robot = kinematics.model();
  const bool usable =
      std::all_of(waypoints.begin(), waypoints.end(), [&](const auto& x) { return IsUsable(robot, x); });
  if (waypoints.size() < 2 || !usable) return {};
  InterpolationScore score{.environment_depth_m = 0, .self_depth_m = 0, .free_share = 0};
  Eigen::VectorXd x(robot.configuration_size());
  Eigen::VectorXd from = ClampedConfiguration(robot, waypoints[0]);
  int free = 0;
  for (size_t w = 1; w < waypoints.size(); ++w) {
    const Eigen::VectorXd to = ClampedConfiguration(robot, waypoints[w]);
    double deepest = 0;
    for (int k = 1; k <= kInterpolationSteps; ++k) {
      InterpolateConfiguration(from, to, static_cast<double>(k) / (kInterpolationSteps + 1), x);
      kinematics.Update(x);
      const double environment = collision.EnvironmentDepth(kinematics);
      const double self = collision.SelfDepth(kinematics).strict_m;
      score.environment_depth_m = std::max(score.environment_depth_m, environment);
      score.self_depth_m = std::max(score.self_depth_m, self);
      deepest = std::max({deepest, environment, self});
    }
    if (deepest <= kFreeDepth_m) ++free;
    from = to;
  }
  score.free_share = static_cast<double>(free) / static_cast<double>(waypoints.size() - 1);
  return score;
}

}  // namespace legopt
