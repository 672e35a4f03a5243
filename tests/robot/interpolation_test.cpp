// The path between two configurations: geodesic base, straight joints, and the derivative of the rotation by
// differences.

#include <gtest/gtest.h>

#include <cmath>

#include "legopt/robot/configuration.h"
#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

/// Returns a robot with one joint.
RobotModel OneJoint() {
  Link base;
  base.name = "base";
  Link arm;
  arm.name = "arm";
  Joint joint;
  joint.name = "joint";
  joint.type = JointType::kRevolute;
  joint.parent_link = 0;
  joint.child_link = 1;
  joint.lower = -3.0;
  joint.upper = 3.0;
  return RobotModel("one joint", {base, arm}, {joint});
}

Eigen::VectorXd Configuration(double q, const Eigen::Vector3d& p, const Eigen::Quaterniond& r) {
  Eigen::VectorXd x(8);
  x << q, p, r.w(), r.vec();
  return x;
}

Eigen::Quaterniond Base(const Eigen::VectorXd& x) { return {x[4], x[5], x[6], x[7]}; }

const Eigen::Quaterniond kStart(0.8, 0.2, -0.4, 0.4);  // norm 1

Eigen::Quaterniond Turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()) * kStart;
}

Eigen::VectorXd At(const RobotModel& robot, const Eigen::VectorXd& a, const Eigen::VectorXd& b, double s) {
  Eigen::VectorXd x(robot.configuration_size());
  InterpolateConfiguration(a, b, s, x);
  return x;
}

TEST(Interpolation, IsStraightInJointsAndPositionAndTurnsEvenly) {
  const RobotModel robot = OneJoint();
  const Eigen::Vector3d axis(1, 2, -1);
  for (const double angle : {0.0, 1e-9, 1e-5, 0.3, 2.9}) {
    const Eigen::VectorXd a = Configuration(0.5, {1, 2, 3}, kStart);
    const Eigen::VectorXd b = Configuration(-0.5, {2, 2, 1}, Turned(angle, axis));
    for (const double s : {0.0, 0.25, 0.5, 1.0}) {
      const Eigen::VectorXd x = At(robot, a, b, s);
      EXPECT_NEAR(x[0], 0.5 - s, 1e-15);
      EXPECT_LT((x.segment<3>(1) - Eigen::Vector3d(1 + s, 2, 3 - 2 * s)).norm(), 1e-15);
      EXPECT_NEAR(x.tail<4>().norm(), 1.0, 1e-15);
      EXPECT_LT((Base(x).toRotationMatrix() - Turned(s * angle, axis).toRotationMatrix()).norm(), 1e-14)
          << angle << " " << s;
    }
  }
}

TEST(Interpolation, SignAndLengthOfQuaternionsDoNotMatter) {
  const RobotModel robot = OneJoint();
  const Eigen::VectorXd a = Configuration(0, {0, 0, 0}, kStart);
  const Eigen::VectorXd b = Configuration(0, {0, 0, 0}, Turned(0.7, {1, 1, 0}));
  Eigen::VectorXd other = b;
  other.tail<4>() *= -3.0;
  EXPECT_LT((At(robot, a, b, 0.3) - At(robot, a, other, 0.3)).norm(), 1e-15);
}

TEST(Interpolation, DerivativeOfTheTurnMeetsFiniteDifferences) {
  const RobotModel robot = OneJoint();
  constexpr double kTurnStep = 1e-6;
  for (const double angle : {0.0, 1e-6, 1e-3, 0.4, 1.5, 2.9}) {
    const Eigen::VectorXd ends[2] = {Configuration(0.2, {0, 1, 0}, kStart),
                                     Configuration(0.1, {0, 0, 1}, Turned(angle, {0.3, -1, 2}))};
    for (const double s : {0.125, 0.5, 0.875}) {
      const BaseRotationDerivatives exact = DifferentiateBaseRotation(ends[0], ends[1], s);
      for (int end = 0; end < 2; ++end) {
        for (int axis = 0; axis < 3; ++axis) {
          Eigen::VectorXd dx = Eigen::VectorXd::Zero(robot.tangent_size());
          Eigen::Quaterniond side[2];
          for (int k = 0; k < 2; ++k) {
            Eigen::VectorXd moved[2] = {ends[0], ends[1]};
            dx[robot.num_dofs() + 3 + axis] = k == 0 ? kTurnStep : -kTurnStep;
            Retract(ends[end], dx, moved[end]);
            side[k] = Base(At(robot, moved[0], moved[1], s));
          }
          Eigen::Quaterniond turn = side[0] * side[1].conjugate();
          if (turn.w() < 0.0) turn.coeffs() *= -1.0;
          const Eigen::Vector3d slope = 2.0 * turn.vec() / (2.0 * kTurnStep);
          EXPECT_LT(((end == 0 ? exact.from : exact.to).col(axis) - slope).norm(), 1e-8) << angle << " " << s;
        }
      }
    }
  }
}

TEST(Interpolation, EndsBelongToTheirOwnTurns) {
  const RobotModel robot = OneJoint();
  const Eigen::VectorXd a = Configuration(0, {0, 0, 0}, kStart);
  const Eigen::VectorXd b = Configuration(0, {0, 0, 0}, Turned(1.1, {1, -1, 3}));
  const BaseRotationDerivatives first = DifferentiateBaseRotation(a, b, 0.0);
  EXPECT_LT((first.from - Eigen::Matrix3d::Identity()).norm() + first.to.norm(), 1e-14);
  const BaseRotationDerivatives last = DifferentiateBaseRotation(a, b, 1.0);
  EXPECT_LT((last.to - Eigen::Matrix3d::Identity()).norm() + last.from.norm(), 1e-14);
}

}  // namespace
}  // namespace legopt
