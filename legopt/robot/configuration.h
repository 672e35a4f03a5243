#pragma once

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <type_traits>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// @file
/// Named parts of the two vectors that describe a robot with n actuated joints (robot_model.h):
///
///     configuration x (n + 7):  joints (n)   base position (3)    base quaternion w x y z (4)
///     tangent dx (n + 6):       joints (n)   base position (3)    base rotation vector (3)
///
/// Joints in rad (m for prismatic joints), positions in m, everything about the base along world axes. A view refers to
/// numbers that must outlive it, derives n from their count, and checks nothing. `Number` is double, or const double
/// for a read-only view. Copying a view does not copy the numbers; distinct views may be used by distinct threads.

/// Parts that both vectors have.
template <typename Number>
class JointsAndBase {
 public:
  Eigen::Index num_joints() const { return joints_; }
  auto joints() const { return Part<Eigen::Dynamic>(0, joints_); }      ///< n values
  auto base_position() const { return Part<3>(joints_, 3); }            ///< or its increment
  auto linear() const { return Part<Eigen::Dynamic>(0, joints_ + 3); }  ///< joints and base position: plain numbers

 protected:
  JointsAndBase(Number* data, Eigen::Index joints) : data_(data), joints_(joints) {}
  template <int size>
  auto Part(Eigen::Index begin, Eigen::Index count) const {
    using Vector = Eigen::Matrix<double, size, 1>;
    return Eigen::Map<std::conditional_t<std::is_const_v<Number>, const Vector, Vector>>(data_ + begin, count);
  }

  Number* data_;
  Eigen::Index joints_;
};

/// View of a configuration.
template <typename Number>
class ConfigurationView : public JointsAndBase<Number> {
 public:
  static constexpr Eigen::Index kBaseSize = 7;  ///< numbers of the base

  ConfigurationView(Number* data, Eigen::Index size) : JointsAndBase<Number>(data, size - kBaseSize) {}

  auto quaternion_coefficients() const { return this->template Part<4>(this->joints_ + 3, 4); }  ///< w x y z
  /// Returns the base quaternion as stored, of any norm.
  Eigen::Quaterniond base_quaternion() const {
    const Number* q = this->data_ + this->joints_ + 3;
    return {q[0], q[1], q[2], q[3]};
  }
  /// Returns the orientation of the base in the world. The stored quaternion must not be zero.
  Eigen::Quaterniond base_rotation() const { return base_quaternion().normalized(); }
  /// Writes a quaternion as it is.
  void set_base_quaternion(const Eigen::Quaterniond& q) const {
    quaternion_coefficients() << q.w(), q.x(), q.y(), q.z();
  }
};

/// View of a tangent.
template <typename Number>
class TangentView : public JointsAndBase<Number> {
 public:
  static constexpr Eigen::Index kBaseSize = 6;  ///< numbers of the base

  TangentView(Number* data, Eigen::Index size) : JointsAndBase<Number>(data, size - kBaseSize) {}

  auto base_rotation() const { return this->template Part<3>(this->joints_ + 3, 3); }  ///< rotation vector, rad
};

/// Returns a read-only view of a contiguous configuration.
inline ConfigurationView<const double> PartsOf(const Eigen::Ref<const Eigen::VectorXd>& x) {
  return {x.data(), x.size()};
}
/// Returns a view that changes a contiguous configuration: MutablePartsOf(x).base_position() = p.
inline ConfigurationView<double> MutablePartsOf(Eigen::Ref<Eigen::VectorXd> x) { return {x.data(), x.size()}; }
/// Returns a read-only view of a contiguous tangent.
inline TangentView<const double> TangentPartsOf(const Eigen::Ref<const Eigen::VectorXd>& dx) {
  return {dx.data(), dx.size()};
}
/// Returns a view that changes a contiguous tangent.
inline TangentView<double> MutableTangentPartsOf(Eigen::Ref<Eigen::VectorXd> dx) { return {dx.data(), dx.size()}; }

/// Returns the configuration with all joints at 0 and the base at `pose`.
inline Eigen::VectorXd ConfigurationAt(int num_joints, const Eigen::Isometry3d& pose) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(num_joints + ConfigurationView<double>::kBaseSize);
  const ConfigurationView<double> parts = MutablePartsOf(x);
  parts.base_position() = pose.translation();
  parts.set_base_quaternion(Eigen::Quaterniond(pose.linear()));
  return x;
}

/// Interpolates between two consecutive waypoints: joints and base position linearly, the base orientation along the
/// geodesic R(s) = Exp(s phi) R_a with phi = Log(R_b R_a^T), |phi| <= pi, in world axes.
///
/// x_s: point of the path from x_a to x_b at s in [0, 1]. All are configurations of RobotModel (n + 7). Input
/// quaternions may have any non-zero norm and either sign; that of x_s is normalised. No allocation.
void InterpolateConfiguration(Eigen::Ref<const Eigen::VectorXd> x_a, Eigen::Ref<const Eigen::VectorXd> x_b, double s,
                              Eigen::Ref<Eigen::VectorXd> x_s);

/// Derivative of the base orientation at s with respect to both end points: dphi_s = from * dphi_a + to * dphi_b, all
/// in the world axes of RobotModel's tangent. For the other parts of the tangent the factors are 1 - s and s.
struct BaseRotationDerivatives {
  Eigen::Matrix3d from;  ///< multiplies dphi_a
  Eigen::Matrix3d to;    ///< multiplies dphi_b
};

/// Computes to = s J(s phi) J(phi)^-1 and from = Exp(s phi) - to Exp(phi), with J the left Jacobian of SO(3). Exact for
/// |phi| < pi. Equals (1 - s) I and s I only if phi = 0 or if the rotation is about phi.
BaseRotationDerivatives DifferentiateBaseRotation(Eigen::Ref<const Eigen::VectorXd> x_a,
                                                  Eigen::Ref<const Eigen::VectorXd> x_b, double s);

}  // namespace legopt
