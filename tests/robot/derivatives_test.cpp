// Every Jacobian of the kinematics against central differences through Retract, on a tree with all joint types, and on
// the same tree with joints that follow others.

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>

#include "legopt/robot/kinematics.h"

namespace legopt {
namespace {

constexpr const char* kMixedTree = R"(
<robot name="mixed">
  <link name="base"><inertial><origin xyz="0.1 0.02 -0.03"/><mass value="7"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="slider"><inertial><origin xyz="0 0.1 0.2"/><mass value="2"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="plate"><inertial><origin xyz="0.3 0 0"/><mass value="0.5"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="wheel"><inertial><origin xyz="0.02 -0.1 0.05"/><mass value="1.5"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="arm"><inertial><origin xyz="0.2 0 0.1"/><mass value="3"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="tip"><inertial><origin xyz="0 0 0.3"/><mass value="1"/>
    <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="slide" type="prismatic"><parent link="base"/><child link="slider"/>
    <origin xyz="0.1 0.2 0.3" rpy="0.3 -0.2 0.5"/><axis xyz="1 2 -0.5"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>
  <joint name="bolt" type="fixed"><parent link="slider"/><child link="plate"/><origin xyz="0 0 0.4" rpy="0.1 0.2 0.3"/></joint>
  <joint name="spin" type="continuous"><parent link="plate"/><child link="wheel"/><origin xyz="0.2 0 0"/><axis xyz="0 1 0"/></joint>
  <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/>
    <origin xyz="-0.1 0 0.5" rpy="0 0.4 0"/><axis xyz="0.3 -0.7 0.6"/><limit lower="-2" upper="2" effort="1" velocity="1"/></joint>
  <joint name="reach" type="prismatic"><parent link="arm"/><child link="tip"/><origin xyz="0 0 0.6"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>)";

constexpr double kStep = 1e-6;       // balances truncation (h^2) and rounding (1e-16 / h)
constexpr double kTolerance = 2e-8;  // values are of order 1 to 100
constexpr double kGravity = 9.8;

/// kMixedTree; if `coupled`, the shoulder follows the wheel, and the tip the slider.
std::string Tree(bool coupled) {
  std::string text = kMixedTree;
  if (!coupled) return text;
  for (const auto& [joint, mimic] :
       {std::pair("name=\"shoulder\"", "<mimic joint='spin' multiplier='-0.7' offset='0.2'/>"),
        std::pair("name=\"reach\"", "<mimic joint='slide' multiplier='0.5' offset='0.5'/>")}) {
    text.insert(text.find("</joint>", text.find(joint)), mimic);
  }
  return text;
}

class Derivatives : public ::testing::TestWithParam<bool> {
 protected:
  Derivatives() : model_(RobotModel::FromUrdfText(Tree(GetParam()), "mixed tree", ".")), kinematics_(model_) {
    std::mt19937 generator(3);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    x_.resize(model_.configuration_size());
    for (double& value : x_) value = uniform(generator);
  }

  /// Compares `jacobian` with central differences of `value`, which reads kinematics_.
  void Check(const Eigen::MatrixXd& jacobian, const std::function<Eigen::VectorXd()>& value) {
    ASSERT_TRUE(jacobian.allFinite()) << "not every entry was written";
    Eigen::VectorXd dx = Eigen::VectorXd::Zero(model_.tangent_size());
    Eigen::VectorXd x(model_.configuration_size());
    for (int i = 0; i < model_.tangent_size(); ++i) {
      dx.setZero();
      dx[i] = kStep;
      Retract(x_, dx, x);
      kinematics_.Update(x);
      const Eigen::VectorXd plus = value();
      Retract(x_, -dx, x);
      kinematics_.Update(x);
      const Eigen::VectorXd column = (plus - value()) / (2 * kStep);
      EXPECT_LT((jacobian.col(i) - column).cwiseAbs().maxCoeff(), kTolerance) << "column " << i;
    }
    kinematics_.Update(x_);
  }

  Eigen::MatrixXd Blank(int rows) {
    return Eigen::MatrixXd::Constant(rows, model_.tangent_size(), std::numeric_limits<double>::quiet_NaN());
  }

  RobotModel model_;
  Kinematics kinematics_;
  Eigen::VectorXd x_;
};

TEST_P(Derivatives, PointsOfEveryLink) {
  const Eigen::Vector3d local(0.3, -0.2, 0.5);
  for (int link = 0; link < static_cast<int>(model_.links().size()); ++link) {
    kinematics_.Update(x_);
    const Eigen::Vector3d point = kinematics_.link_pose(link) * local;
    Eigen::MatrixXd jacobian = Blank(3);
    kinematics_.PointJacobian(link, point, jacobian);
    Eigen::VectorXd row = Eigen::VectorXd::Constant(model_.tangent_size(), 1.0);
    const Eigen::Vector3d normal = Eigen::Vector3d(1, -2, 0.5).normalized();
    kinematics_.AddPointGradient(link, point, normal, 2.0, row.data());
    EXPECT_LT((row - Eigen::VectorXd::Ones(row.size()) - 2.0 * jacobian.transpose() * normal).norm(), 1e-12);
    Check(jacobian, [&] { return Eigen::VectorXd(kinematics_.link_pose(link) * local); });
  }
}

TEST_P(Derivatives, RotationOfEveryLink) {
  for (int link = 0; link < static_cast<int>(model_.links().size()); ++link) {
    kinematics_.Update(x_);
    Eigen::MatrixXd angular = Blank(3);
    kinematics_.AngularJacobian(link, angular);
    const Eigen::Matrix3d rotation = kinematics_.link_pose(link).linear();
    // d(R e)/dx = omega x (R e) for three directions e.
    for (int k = 0; k < 3; ++k) {
      Eigen::MatrixXd jacobian(3, model_.tangent_size());
      for (int i = 0; i < model_.tangent_size(); ++i) {
        jacobian.col(i) = Eigen::Vector3d(angular.col(i)).cross(Eigen::Vector3d(rotation.col(k)));
      }
      Check(jacobian, [&] { return Eigen::VectorXd(kinematics_.link_pose(link).linear().col(k)); });
    }
  }
}

TEST_P(Derivatives, CentreOfMass) {
  kinematics_.Update(x_);
  Eigen::MatrixXd jacobian = Blank(3);
  kinematics_.ComJacobian(jacobian);
  Check(jacobian, [&] { return Eigen::VectorXd(kinematics_.com()); });
}

TEST_P(Derivatives, CentreOfMassIsTheMassWeightedMeanOfLinks) {
  kinematics_.Update(x_);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < model_.links().size(); ++i) {
    sum += model_.links()[i].mass * (kinematics_.link_pose(static_cast<int>(i)) * model_.links()[i].com);
  }
  EXPECT_LT((sum / model_.total_mass() - kinematics_.com()).norm(), 1e-12);
}

TEST_P(Derivatives, GravityTorquesAreTheGradientOfThePotential) {
  kinematics_.Update(x_);
  const int n = model_.num_dofs();
  Eigen::VectorXd tau = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::quiet_NaN());
  kinematics_.GravityTorques(kGravity, tau);
  Eigen::MatrixXd gradient = Eigen::MatrixXd::Zero(1, model_.tangent_size());
  gradient.leftCols(n) = tau.transpose();
  gradient(0, n + 2) = kGravity * model_.total_mass();
  Eigen::MatrixXd com(3, model_.tangent_size());
  kinematics_.ComJacobian(com);
  gradient.rightCols(3) = kGravity * model_.total_mass() * com.row(2).tail(3);
  Check(gradient, [&] { return Eigen::VectorXd::Constant(1, kGravity * model_.total_mass() * kinematics_.com().z()); });
}

TEST_P(Derivatives, GravityTorqueJacobian) {
  kinematics_.Update(x_);
  Eigen::MatrixXd jacobian = Blank(model_.num_dofs());
  kinematics_.GravityTorqueJacobian(kGravity, jacobian);
  EXPECT_LT((jacobian.leftCols(model_.num_dofs()) - jacobian.leftCols(model_.num_dofs()).transpose()).norm(), 1e-12);
  Check(jacobian, [&] {
    Eigen::VectorXd tau(model_.num_dofs());
    kinematics_.GravityTorques(kGravity, tau);
    return tau;
  });
}

TEST_P(Derivatives, QuaternionNormDoesNotMatter) {
  kinematics_.Update(x_);
  const Eigen::Vector3d com = kinematics_.com();
  x_.tail<4>() *= 3.7;
  kinematics_.Update(x_);
  EXPECT_LT((kinematics_.com() - com).norm(), 1e-13);
}

TEST_P(Derivatives, RetractTurnsAboutWorldAxes) {
  Eigen::VectorXd dx = Eigen::VectorXd::Zero(model_.tangent_size());
  const Eigen::Vector3d phi(0.4, -0.3, 0.9);
  dx.tail<3>() = phi;
  Eigen::VectorXd x(model_.configuration_size());
  Retract(x_, dx, x);
  kinematics_.Update(x_);
  const Eigen::Matrix3d before = kinematics_.link_pose(0).linear();
  kinematics_.Update(x);
  const Eigen::Matrix3d expected = Eigen::AngleAxisd(phi.norm(), phi.normalized()).toRotationMatrix() * before;
  EXPECT_LT((kinematics_.link_pose(0).linear() - expected).norm(), 1e-13);
}

INSTANTIATE_TEST_SUITE_P(Tree, Derivatives, testing::Values(false, true),
                         [](const auto& coupled) { return coupled.param ? "WithFollowers" : "Independent"; });

}  // namespace
}  // namespace legopt
