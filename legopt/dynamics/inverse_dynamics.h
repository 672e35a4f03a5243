#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/dynamics/internal/body_mass.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"

namespace legopt {

/// Forces that a motion needs, without gravity and contacts.
struct InertialForces {
  Eigen::VectorXd torques;                            ///< n, N m or N: of the joints with the base held
  Eigen::Vector3d force_N = Eigen::Vector3d::Zero();  ///< rate of the linear momentum, in the world
  /// Rate of the angular momentum about the centre of mass, in the world, N m.
  Eigen::Vector3d moment_Nm = Eigen::Vector3d::Zero();
};

/// Inverse dynamics of a floating-base robot by the recursive Newton-Euler algorithm, in world axes. With contact
/// forces f_k at points p_k, the equations of motion are
///
///     sum_k f_k = M g e_z + force,    sum_k (p_k - c) x f_k = moment,    c: centre of mass
///     tau = g(q) + torques - sum_k J_k(q)^T f_k,                         g: Kinematics::GravityTorques
///
/// Links connected by fixed joints move as one rigid body. A joint that follows another one contributes its torque
/// times its multiplier. Rotors, friction and damping do not count.
///
/// A workspace: allocated once, not thread-safe. Source: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 5.
class InverseDynamics {
 public:
  /// `robot` must outlive this object.
  explicit InverseDynamics(const RobotModel& robot);

  /// Computes the forces for a velocity and an acceleration. Both have n + 6 numbers, ordered as RobotModel's tangent:
  /// joints in rad/s (m/s), base position in m/s, angular velocity of the base in rad/s along world axes, and their
  /// derivatives. `kinematics`: after Update().
  void Compute(const Kinematics& kinematics, Eigen::Ref<const Eigen::VectorXd> velocity,
               Eigen::Ref<const Eigen::VectorXd> acceleration, InertialForces* forces);

 private:
  /// Constants of a rigid body in the frame of its first link.
  struct Body {
    int link = 0;    ///< first link
    int parent = 0;  ///< body
    const Joint* joint = nullptr;
    BodyMass properties;
  };
  /// Motion of a body and the forces on it and everything that it carries.
  struct State {
    Eigen::Vector3d axis_W = Eigen::Vector3d::Zero(), origin_W = Eigen::Vector3d::Zero();
    Eigen::Vector3d spin = Eigen::Vector3d::Zero();                                     ///< angular velocity
    Eigen::Vector3d spin_rate = Eigen::Vector3d::Zero();                                ///< angular acceleration
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();                                     ///< acceleration of the origin
    Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();  ///< moment about the origin
  };

  void Propagate(const Body& body, double speed, double acceleration, State* state) const;
  void SetInertialForces(const Kinematics& kinematics, size_t body);

  const RobotModel* robot_;
  std::vector<Body> bodies_;
  std::vector<State> states_;
};

}  // namespace legopt
