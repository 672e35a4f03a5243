#include "legopt/evaluate/interpolation.h"

#include <algorithm>

namespace legopt {
namespace {

// Beyond it a pose may overflow in kinematics; nothing that a solver returns comes near.
constexpr double kLargestNumber = 1e6;

bool IsUsable(const RobotModel& robot, const Eigen::VectorXd& x) {
  return x.size() == robot.configuration_size() && x.allFinite() && x.cwiseAbs().maxCoeff() <= kLargestNumber &&
         x.tail<4>().stableNorm() > 0;
}

Eigen::Quaterniond Rotation(const Eigen::VectorXd& x) {
  const Eigen::Vector4d wxyz = x.tail<4>().stableNormalized();
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}

}  // namespace

void Interpolate(const RobotModel& robot, const Eigen::VectorXd& a, const Eigen::VectorXd& b, double t,
                 Eigen::VectorXd* x) {
  const int n = robot.num_dofs();
  const auto clamped = [&](const Eigen::VectorXd& waypoint) {
    return waypoint.head(n).cwiseMax(robot.lower_limits()).cwiseMin(robot.upper_limits());
  };
  x->resize(a.size());
  x->head(n) = (1 - t) * clamped(a) + t * clamped(b);
  x->segment<3>(n) = (1 - t) * a.segment<3>(n) + t * b.segment<3>(n);
  const Eigen::Quaterniond rotation = Rotation(a).slerp(t, Rotation(b)).normalized();
  x->tail<4>() << rotation.w(), rotation.x(), rotation.y(), rotation.z();
}

InterpolationScore ScoreInterpolation(std::span<const Eigen::VectorXd> waypoints, Kinematics& kinematics,
                                      ExactCollision& collision) {
  const RobotModel& robot = kinematics.model();
  const bool usable =
      std::all_of(waypoints.begin(), waypoints.end(), [&](const auto& x) { return IsUsable(robot, x); });
  if (waypoints.size() < 2 || !usable) return {};
  InterpolationScore score{.environment_depth_m = 0, .self_depth_m = 0, .free_share = 0};
  Eigen::VectorXd x(robot.configuration_size());
  int free = 0;
  for (size_t w = 1; w < waypoints.size(); ++w) {
    double deepest = 0;
    for (int k = 1; k <= kInterpolationSteps; ++k) {
      Interpolate(robot, waypoints[w - 1], waypoints[w], static_cast<double>(k) / (kInterpolationSteps + 1), &x);
      kinematics.Update(x);
      const double environment = collision.EnvironmentDepth(kinematics);
      const double self = collision.SelfDepth(kinematics).strict_m;
      score.environment_depth_m = std::max(score.environment_depth_m, environment);
      score.self_depth_m = std::max(score.self_depth_m, self);
      deepest = std::max({deepest, environment, self});
    }
    if (deepest <= kFreeDepth_m) ++free;
  }
  score.free_share = static_cast<double>(free) / static_cast<double>(waypoints.size() - 1);
  return score;
}

}  // namespace legopt
