// Compares the Atlas kinematics with figures that were computed independently, and with its joint table.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "legopt/robot/kinematics.h"
#include "tests/folders.h"

namespace legopt {
namespace {

constexpr double kAtlasGravity = 9.797930195020351;
constexpr double kDegree = M_PI / 180.0;

class AtlasRegression : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string urdf = TestDataFolder() + "/atlas/atlas.urdf";
    if (!std::filesystem::exists(urdf)) GTEST_SKIP() << "benchmark data not found: " << urdf;
    model_ = std::make_unique<RobotModel>(RobotModel::FromUrdfFile(urdf));
    kinematics_ = std::make_unique<Kinematics>(*model_);
    x_ = Eigen::VectorXd::Zero(model_->configuration_size());
    x_[model_->num_dofs() + 3] = 1.0;
  }

  void SetJoint(const std::string& name, double value) {
    const int joint = model_->FindJoint(name);
    ASSERT_GE(joint, 0) << name;
    x_[model_->joints()[static_cast<size_t>(joint)].dof] = value;
  }

  void SetNominalLegs() {
    for (const char* side : {"l", "r"}) {
      SetJoint(std::string(side) + "_leg_kny", 50 * kDegree);
      SetJoint(std::string(side) + "_leg_lhy", -25 * kDegree);
      SetJoint(std::string(side) + "_leg_uay", -25 * kDegree);
    }
  }

  void SetArms(double shx) {
    SetJoint("l_arm_shx", -shx);
    SetJoint("r_arm_shx", shx);
  }

  double Torque2() {
    Eigen::VectorXd tau(model_->num_dofs());
    kinematics_->GravityTorques(kAtlasGravity, tau);
    return tau.squaredNorm();
  }

  Eigen::Vector3d LinkOrigin(const std::string& name) {
    return kinematics_->link_pose(model_->FindLink(name)).translation();
  }

  static void ExpectNear(const Eigen::Vector3d& actual, double x, double y, double z, double tolerance) {
    EXPECT_NEAR(actual.x(), x, tolerance);
    EXPECT_NEAR(actual.y(), y, tolerance);
    EXPECT_NEAR(actual.z(), z, tolerance);
  }

  std::unique_ptr<RobotModel> model_;
  std::unique_ptr<Kinematics> kinematics_;
  Eigen::VectorXd x_;
};

constexpr double kLength = 1e-6;  // precision of the figures
constexpr double kTorque = 1e-3;

TEST_F(AtlasRegression, ZeroConfiguration) {
  kinematics_->Update(x_);
  ExpectNear(kinematics_->com(), 0.018148, -0.000282, 0.079971, kLength);
  ExpectNear(LinkOrigin("l_foot"), 0, 0.089, -0.846, kLength);
  ExpectNear(LinkOrigin("l_hand"), 0.0115, 0.848, 0.465, kLength);
  EXPECT_NEAR(Torque2(), 3090.699, kTorque);
}

TEST_F(AtlasRegression, NominalConfiguration) {
  SetNominalLegs();
  SetArms(1.3);
  kinematics_->Update(x_);
  ExpectNear(kinematics_->com(), 0.039950, -0.000282, 0.009228, kLength);
  ExpectNear(LinkOrigin("l_foot"), -0.015601, 0.089, -0.792552, kLength);
  ExpectNear(LinkOrigin("l_hand"), 0.0115, 0.443659, -0.066884, kLength);
  EXPECT_NEAR(Torque2(), 529.400, kTorque);

  Eigen::VectorXd tau(model_->num_dofs());
  kinematics_->GravityTorques(kAtlasGravity, tau);
  const auto torque = [&](const char* name) {
    return tau[model_->joints()[static_cast<size_t>(model_->FindJoint(name))].dof];
  };
  EXPECT_NEAR(torque("back_mby"), -12.142, kTorque);
  EXPECT_NEAR(std::abs(torque("l_arm_shx")), 9.843, kTorque);
  EXPECT_NEAR(std::abs(torque("l_arm_elx")), 2.475, kTorque);
  EXPECT_NEAR(torque("l_leg_lhy"), -7.182, kTorque);
  EXPECT_NEAR(torque("l_leg_kny"), 5.941, kTorque);
  EXPECT_NEAR(torque("neck_ay"), 1.057, kTorque);
  EXPECT_NEAR(std::abs(torque("l_arm_mwx")), 0.552, kTorque);
  EXPECT_NEAR(torque("l_leg_uay"), -0.432, kTorque);
}

TEST_F(AtlasRegression, NominalWithArmsAtTheirLimitsAndOut) {
  SetNominalLegs();
  SetArms(1.39626);
  kinematics_->Update(x_);
  ExpectNear(kinematics_->com(), 0.0399, -0.0003, 0.0075, 1e-4);
  EXPECT_NEAR(Torque2(), 409.5, 0.05);
  SetArms(0.0);
  kinematics_->Update(x_);
  ExpectNear(kinematics_->com(), 0.0399, -0.0003, 0.0882, 1e-4);
  EXPECT_NEAR(Torque2(), 3251.3, 0.05);
}

TEST_F(AtlasRegression, GeneralConfiguration) {
  const int n = model_->num_dofs();
  ASSERT_EQ(n, 29);
  for (int i = 0; i < n; ++i) x_[i] = 0.01 * (i + 1);
  x_.tail<7>() << 1, 2, 3, 0.9, 0.1, -0.2, 0.3;
  kinematics_->Update(x_);
  ExpectNear(kinematics_->com(), 0.941186, 1.973348, 3.066466, kLength);
  ExpectNear(LinkOrigin("l_foot"), 0.936068, 2.259473, 2.197972, kLength);
  ExpectNear(LinkOrigin("l_hand"), 0.316160, 2.486643, 3.528346, kLength);
  EXPECT_NEAR(Torque2(), 6260.614, kTorque);
}

TEST_F(AtlasRegression, TreeOrderLimitsAndMass) {
  EXPECT_EQ(model_->links().size(), 41u);
  EXPECT_EQ(model_->joints().size(), 40u);
  EXPECT_NEAR(model_->total_mass(), 90.7776740, 1e-6);

  std::ifstream table(ReferenceFolder() + "/atlas-joints.csv");
  if (!table) GTEST_SKIP() << "joint table not found";
  std::string line;
  std::getline(table, line);
  size_t joint = 0;
  while (std::getline(table, line)) {
    std::vector<std::string> cell;
    std::stringstream row(line);
    for (std::string field; std::getline(row, field, ',');) cell.push_back(field);
    ASSERT_LT(joint, model_->joints().size());
    const Joint& actual = model_->joints()[joint++];
    EXPECT_EQ(actual.name, cell[2]);
    EXPECT_EQ(model_->links()[static_cast<size_t>(actual.parent_link)].name, cell[4]);
    EXPECT_EQ(model_->links()[static_cast<size_t>(actual.child_link)].name, cell[5]);
    EXPECT_EQ(actual.dof, cell[0].empty() ? -1 : std::stoi(cell[0])) << actual.name;
    if (actual.type != JointType::kRevolute) continue;
    EXPECT_NEAR(actual.lower, std::stod(cell[15]), 1e-5) << actual.name;
    EXPECT_NEAR(actual.upper, std::stod(cell[16]), 1e-5) << actual.name;
  }
  EXPECT_EQ(joint, model_->joints().size());
}

}  // namespace
}  // namespace legopt
