#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "legopt/dataset/dataset.h"

namespace legopt::client {

/// Simulation of a robot and a scene by ODE: rigid bodies, joints without friction, contacts with Coulomb friction.
///
/// Only contacts meet the scene, each at its points with a small ball whose lowest point lies in the plane that the
/// contact's target has; the ball of a point contact has the contact's own radius. Other parts of the robot pass
/// through everything. A hand on a bar is held by a ball joint as long as Hold() names it, whatever the force. Joints
/// have no stops. Links without mass get kLeastMass_kg.
///
/// Not thread-safe.
class RigidBodyWorld {
 public:
  static constexpr double kLeastMass_kg = 1e-3;

  /// Places the robot at rest. `x`: configuration, n + 7. `dataset` must outlive this object. Throws InputError for a
  /// robot with joints that follow others.
  RigidBodyWorld(const Dataset& dataset, Eigen::Ref<const Eigen::VectorXd> x);
  ~RigidBodyWorld();
  RigidBodyWorld(const RigidBodyWorld&) = delete;
  RigidBodyWorld& operator=(const RigidBodyWorld&) = delete;

  /// States the contacts that hold from now on: friction of their surfaces, and the bars that hands grip.
  void Hold(const Stance& contacts);
  /// Advances by `step_s` > 0, with joint torques (n, N m or N).
  void Step(Eigen::Ref<const Eigen::VectorXd> torques, double step_s);

  /// Returns the configuration, n + 7, with a unit quaternion. Angles are continuous in time.
  const Eigen::VectorXd& x() const { return x_; }
  /// Returns its derivative by time as a tangent, n + 6: base rotation in world axes.
  const Eigen::VectorXd& velocity() const { return velocity_; }

 private:
  class Impl;
  void Measure();

  std::unique_ptr<Impl> impl_;
  Eigen::VectorXd x_, velocity_;
};

}  // namespace legopt::client
