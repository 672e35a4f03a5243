#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "legopt/geometry/scene.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "tests/folders.h"

namespace legopt::test {

/// Returns the folder of the shared benchmark data: environment LEGOPT_TEST_DATA, else the folder configured in the
/// build.
inline std::filesystem::path DataFolder() {
  const char* folder = std::getenv("LEGOPT_TEST_DATA");
  return folder != nullptr ? folder : TestDataFolder();
}

/// Skips the running test, with a message, if the shared data are missing.
#define LEGOPT_REQUIRE_FILE(path) \
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "test data missing: " << (path) << " (set LEGOPT_TEST_DATA)"

inline RobotModel Atlas() { return RobotModel::FromUrdfFile((DataFolder() / "atlas/atlas.urdf").string()); }

inline std::string GarageFile() { return (DataFolder() / "garage_reconstructed.stl").string(); }

inline Scene Garage() {
  SceneObject garage;
  garage.name = "garage";
  garage.shape.kind = ShapeSpec::Kind::kMesh;
  garage.shape.mesh_file = GarageFile();
  return {{garage}};
}

inline Eigen::VectorXd ZeroPose(const RobotModel& robot) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(robot.configuration_size());
  x[robot.num_dofs() + 3] = 1.0;
  return x;
}

/// Returns the evaluator's reference pose for self-collision (docs/explanation/judge.md#ignored-link-pairs).
inline Eigen::VectorXd AtlasReference(const RobotModel& robot) {
  Eigen::VectorXd x = ZeroPose(robot);
  x[0] = x[2] = 20.0 * 3.1415 / 180.0;
  return x;
}

struct ContactPose {
  std::string link;
  Eigen::Vector3d position;
  Eigen::Quaterniond rotation;
};

/// Reads all stances of a problem file: position and rotation of each contact, quaternion order w x y z.
inline std::vector<std::vector<ContactPose>> ReadStances(const std::filesystem::path& file) {
  nlohmann::json root;
  std::ifstream(file) >> root;
  std::vector<std::vector<ContactPose>> stances;
  for (const auto& problem : root.at("problems")) {
    for (const auto& text : problem.at("definition")) {
      std::stringstream fields(text.get<std::string>());
      std::vector<ContactPose>& stance = stances.emplace_back();
      std::string link;
      std::string pose;
      while (std::getline(fields, link, ',') && std::getline(fields, pose, ',')) {
        std::stringstream numbers(pose);
        double v[7] = {};
        for (double& value : v) numbers >> value;
        stance.push_back({link, {v[4], v[5], v[6]}, Eigen::Quaterniond(v[0], v[1], v[2], v[3]).normalized()});
      }
    }
  }
  return stances;
}

/// Returns the target of the foot's link frame (docs/explanation/paper.md#foot-targets).
inline Eigen::Isometry3d FootFrame(const ContactPose& sole) {
  constexpr double kContactFrameOffset = 0.082351;
  const Eigen::Matrix3d rotation = sole.rotation.toRotationMatrix();
  return Eigen::Translation3d(sole.position + kContactFrameOffset * rotation.col(2)) * Eigen::Isometry3d(rotation);
}

/// Returns a plausible posture with both feet on their contacts: nominal joints, legs by damped least squares. For
/// tests and benchmarks.
inline Eigen::VectorXd StandOn(const RobotModel& robot, const std::vector<ContactPose>& stance) {
  const int n = robot.num_dofs();
  const int m = robot.tangent_size();
  Eigen::VectorXd x = ZeroPose(robot);
  const auto set = [&](const std::string& joint, double value) {
    x[robot.joints()[static_cast<size_t>(robot.FindJoint(joint))].dof] = value;
  };
  constexpr double kKnee = 50.0 * M_PI / 180.0;
  for (const std::string side : {"l", "r"}) {
    set(side + "_leg_kny", kKnee);
    set(side + "_leg_lhy", -0.5 * kKnee);
    set(side + "_leg_uay", -0.5 * kKnee);
  }
  set("l_arm_shx", -1.3);
  set("r_arm_shx", 1.3);
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  for (const ContactPose& sole : stance) {
    x.segment<3>(n) += sole.position / static_cast<double>(stance.size());
    heading += (sole.rotation * Eigen::Vector3d::UnitX()).head<2>();
  }
  x[n + 2] += 0.87;
  const double yaw = std::atan2(heading.y(), heading.x());
  x[n + 3] = std::cos(0.5 * yaw);
  x[n + 6] = std::sin(0.5 * yaw);

  Kinematics kinematics(robot);
  const auto rows = static_cast<Eigen::Index>(6 * stance.size());
  Eigen::MatrixXd jacobian(rows, m);
  Eigen::MatrixXd block(3, m);
  Eigen::VectorXd error(rows);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(m);
  weight.head(17).setConstant(1e-4);  // arms and trunk stay
  constexpr int kIterations = 60;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    kinematics.Update(x);
    for (size_t i = 0; i < stance.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(6 * i);
      const int link = robot.FindLink(stance[i].link);
      const Eigen::Isometry3d target = FootFrame(stance[i]);
      const Eigen::Isometry3d& actual = kinematics.link_pose(link);
      const Eigen::AngleAxisd turn(target.linear() * actual.linear().transpose());
      kinematics.PointJacobian(link, actual.translation(), block);
      jacobian.middleRows(row, 3) = block;
      kinematics.AngularJacobian(link, block);
      jacobian.middleRows(row + 3, 3) = block;
      error.segment<3>(row) = target.translation() - actual.translation();
      error.segment<3>(row + 3) = turn.angle() * turn.axis();
    }
    const Eigen::MatrixXd weighted = jacobian * weight.asDiagonal();
    const Eigen::MatrixXd damped = weighted * jacobian.transpose() + 1e-6 * Eigen::MatrixXd::Identity(rows, rows);
    const Eigen::VectorXd dx = weighted.transpose() * damped.ldlt().solve(error);
    Eigen::VectorXd next = x;
    Retract(x, std::min(1.0, 0.3 / dx.cwiseAbs().maxCoeff()) * dx, next);
    x = next;
    x.head(n) = x.head(n).cwiseMax(robot.lower_limits()).cwiseMin(robot.upper_limits());
  }
  return x;
}

}  // namespace legopt::test
