// Inverse dynamics against Lagrange's equations, with kinetic energy and momenta from Jacobians alone.
#include "legopt/dynamics/inverse_dynamics.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

constexpr const char* kTree = R"(
<robot name="mixed">
  <link name="base"><inertial><origin xyz="0.1 0.02 -0.03" rpy="0.2 0.1 -0.4"/><mass value="7"/>
    <inertia ixx="0.3" iyy="0.4" izz="0.5" ixy="0.02" ixz="-0.03" iyz="0.01"/></inertial></link>
  <link name="slider"><inertial><origin xyz="0 0.1 0.2"/><mass value="2"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.15" ixy="0.01" ixz="0" iyz="0"/></inertial></link>
  <link name="plate"><inertial><origin xyz="0.3 0 0" rpy="0 0.5 0"/><mass value="0.5"/>
    <inertia ixx="0.02" iyy="0.03" izz="0.04" ixy="0" ixz="0.002" iyz="0"/></inertial></link>
  <link name="wheel"><inertial><origin xyz="0.02 -0.1 0.05"/><mass value="1.5"/>
    <inertia ixx="0.1" iyy="0.12" izz="0.05" ixy="0" ixz="0" iyz="0.01"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.2 0 0.1"/><mass value="3"/>
    <inertia ixx="0.2" iyy="0.3" izz="0.25" ixy="0" ixz="0.05" iyz="0"/></inertial></link>
  <link name="tip"><inertial><origin xyz="0 0 0.3"/><mass value="1"/>
    <inertia ixx="0.05" iyy="0.05" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="slider"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.3 -0.2 0.5"/><axis xyz="1 2 -0.5"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="bolt" type="fixed"><parent link="slider"/><child link="plate"/><origin xyz="0 0 0.4" rpy="0.1 0.2 0.3"/></joint>
  <joint name="spin" type="continuous"><parent link="plate"/><child link="wheel"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="-0.1 0 0.5" rpy="0 0.4 0"/><axis xyz="0.3 -0.7 0.6"/><limit lower="-2" upper="2" effort="1" velocity="1"/>MIMIC</joint>
  <joint name="reach" type="prismatic"><parent link="arm"/><child link="tip"/><origin xyz="0 0 0.6"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>)";

/// Parameter: whether the shoulder follows the wheel.
class InverseDynamicsOfATree : public ::testing::TestWithParam<bool> {
 protected:
  InverseDynamicsOfATree() : robot_(Read(GetParam())), kinematics_(robot_) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    const auto draw = [&](Eigen::Index size) {
      Eigen::VectorXd v(size);
      for (double& number : v) number = unit(random);
      return v;
    };
    x_ = draw(robot_.configuration_size());
    x_.tail<4>().normalize();
    velocity_ = 2.0 * draw(robot_.tangent_size());
    acceleration_ = 3.0 * draw(robot_.tangent_size());
  }

  static RobotModel Read(bool follows) {
    std::string text = kTree;
    text.replace(text.find("MIMIC"), 5, follows ? "<mimic joint='spin' multiplier='-0.7' offset='0.2'/>" : "");
    return RobotModel::FromUrdfText(text, "mixed.urdf", ".");
  }

  /// Configuration and velocity at time t of a motion with x_, velocity_ and acceleration_ at time 0. Exact up to
  /// second order, since the derivative of Exp(phi) at phi = 0 is phi' and that of the angular velocity is phi''.
  void MoveTo(double t, Eigen::VectorXd* x, Eigen::VectorXd* velocity) {
    x->resize(x_.size());
    Retract(x_, t * velocity_ + 0.5 * t * t * acceleration_, *x);
    *velocity = velocity_ + t * acceleration_;
  }

  struct Momentum {
    double energy = 0.0;
    Eigen::VectorXd generalized;
    Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();
  };

  Momentum MomentumOf(const Eigen::VectorXd& x, const Eigen::VectorXd& velocity) {
    kinematics_.Update(x);
    Momentum sum;
    sum.generalized.setZero(robot_.tangent_size());
    Eigen::MatrixXd J(3, robot_.tangent_size()), W(3, robot_.tangent_size());
    for (int l = 0; l < std::ssize(robot_.links()); ++l) {
      const Link& link = robot_.links()[static_cast<size_t>(l)];
      const Eigen::Isometry3d& pose = kinematics_.link_pose(l);
      const Eigen::Vector3d com = pose * link.com;
      kinematics_.PointJacobian(l, com, J);
      kinematics_.AngularJacobian(l, W);
      const Eigen::Matrix3d I = pose.linear() * link.inertia * pose.linear().transpose();
      const Eigen::Vector3d v = J * velocity, w = W * velocity;
      sum.energy += 0.5 * link.mass * v.squaredNorm() + 0.5 * w.dot(I * w);
      sum.generalized += link.mass * J.transpose() * v + W.transpose() * (I * w);
      sum.linear += link.mass * v;
      sum.angular += link.mass * (com - kinematics_.com()).cross(v) + I * w;
    }
    return sum;
  }

  RobotModel robot_;
  Kinematics kinematics_;
  Eigen::VectorXd x_, velocity_, acceleration_;
};

TEST_P(InverseDynamicsOfATree, SatisfiesLagrangesEquations) {
  constexpr double kStep = 1e-5, kTolerance = 1e-7;
  Eigen::VectorXd x, velocity;
  MoveTo(kStep, &x, &velocity);
  const Momentum after = MomentumOf(x, velocity);
  MoveTo(-kStep, &x, &velocity);
  const Momentum before = MomentumOf(x, velocity);

  kinematics_.Update(x_);
  InertialForces forces;
  InverseDynamics(robot_).Compute(kinematics_, velocity_, acceleration_, &forces);
  EXPECT_LT((forces.force_N - (after.linear - before.linear) / (2 * kStep)).norm(), kTolerance * 100);
  EXPECT_LT((forces.moment_Nm - (after.angular - before.angular) / (2 * kStep)).norm(), kTolerance * 100);
  for (int dof = 0; dof < robot_.num_dofs(); ++dof) {
    Eigen::VectorXd up = x_, down = x_;
    up[dof] += kStep;
    down[dof] -= kStep;
    const double slope = (MomentumOf(up, velocity_).energy - MomentumOf(down, velocity_).energy) / (2 * kStep);
    const double rate = (after.generalized[dof] - before.generalized[dof]) / (2 * kStep);
    EXPECT_NEAR(forces.torques[dof], rate - slope, kTolerance * 100) << dof;
  }
}

TEST_P(InverseDynamicsOfATree, GravityIsAnAccelerationOfTheBase) {
  constexpr double kGravity = 9.8;
  kinematics_.Update(x_);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(robot_.tangent_size());
  Eigen::VectorXd upwards = rest;
  upwards[robot_.base_position_index() + 2] = kGravity;
  InertialForces forces;
  InverseDynamics(robot_).Compute(kinematics_, rest, upwards, &forces);
  Eigen::VectorXd torques(robot_.num_dofs());
  kinematics_.GravityTorques(kGravity, torques);
  EXPECT_LT((forces.torques - torques).norm(), 1e-10);
  EXPECT_LT((forces.force_N - robot_.total_mass() * kGravity * Eigen::Vector3d::UnitZ()).norm(), 1e-10);
  EXPECT_LT(forces.moment_Nm.norm(), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Couplings, InverseDynamicsOfATree, ::testing::Bool());

}  // namespace
}  // namespace legopt
