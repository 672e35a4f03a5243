#include "legopt/robot/configuration.h"

#include <cmath>

namespace legopt {
namespace {

constexpr double kSmallAngle = 1e-4;  // below it, the next terms of the series vanish in double precision

/// Rotation vector of the shorter rotation from a to b, world axes.
Eigen::Vector3d Turn(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  Eigen::Quaterniond turn = b * a.conjugate();
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;
  const double sine = turn.vec().norm();
  const double scale = sine < kSmallAngle ? 2.0 / turn.w() : 2.0 * std::atan2(sine, turn.w()) / sine;
  return scale * turn.vec();
}

Eigen::Quaterniond Exp(const Eigen::Vector3d& phi) {
  const double half = 0.5 * phi.norm();
  const double half_sinc = half < kSmallAngle ? 0.5 - half * half / 12.0 : 0.5 * std::sin(half) / half;
  Eigen::Quaterniond turn;
  turn.w() = std::cos(half);
  turn.vec() = half_sinc * phi;
  return turn;
}

Eigen::Matrix3d Cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Left Jacobian of SO(3): Exp(phi + d) ~ Exp(J d) Exp(phi).
Eigen::Matrix3d LeftJacobian(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const double square = angle * angle;
  const bool small = angle < kSmallAngle;
  const double half_sine = std::sin(0.5 * angle);
  const double a = small ? 0.5 - square / 24.0 : 2.0 * half_sine * half_sine / square;
  const double b = small ? 1.0 / 6.0 - square / 120.0 : (angle - std::sin(angle)) / (square * angle);
  const Eigen::Matrix3d cross = Cross(phi);
  return Eigen::Matrix3d::Identity() + a * cross + b * cross * cross;
}

Eigen::Matrix3d InverseLeftJacobian(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  const double square = angle * angle;
  const double half = 0.5 * angle;
  const double b = angle < kSmallAngle ? 1.0 / 12.0 + square / 720.0 : (1.0 - half / std::tan(half)) / square;
  const Eigen::Matrix3d cross = Cross(phi);
  return Eigen::Matrix3d::Identity() - 0.5 * cross + b * cross * cross;
}

}  // namespace

void InterpolateConfiguration(Eigen::Ref<const Eigen::VectorXd> x_a, Eigen::Ref<const Eigen::VectorXd> x_b, double s,
                              Eigen::Ref<Eigen::VectorXd> x_s) {
  const auto a = PartsOf(x_a), b = PartsOf(x_b);
  const auto result = MutablePartsOf(x_s);
  result.linear() = (1.0 - s) * a.linear() + s * b.linear();
  const Eigen::Quaterniond base = a.base_rotation();
  result.set_base_quaternion((Exp(s * Turn(base, b.base_rotation())) * base).normalized());
}

BaseRotationDerivatives DifferentiateBaseRotation(Eigen::Ref<const Eigen::VectorXd> x_a,
                                                  Eigen::Ref<const Eigen::VectorXd> x_b, double s) {
  const Eigen::Vector3d phi = Turn(PartsOf(x_a).base_rotation(), PartsOf(x_b).base_rotation());
  BaseRotationDerivatives derivatives;
  derivatives.to = s * LeftJacobian(s * phi) * InverseLeftJacobian(phi);
  derivatives.from = Exp(s * phi).toRotationMatrix() - derivatives.to * Exp(phi).toRotationMatrix();
  return derivatives;
}

}  // namespace legopt
