// Policy: the embedded robot equals the benchmark's Atlas in everything but its shape. Kinematics, limits and masses
// equal tables made from the original file (skipped with a message if these are missing), and its own shapes do not
// restrict its motion.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>

#include "legopt/geometry/internal/exact_collision.h"
#include "tests/data/embedded_dataset.h"
#include "tests/folders.h"

namespace legopt {
namespace {

using Row = std::map<std::string, std::string>;

std::vector<std::string> Split(const std::string& line) {
  std::vector<std::string> fields;
  std::istringstream stream(line);
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  return fields;
}

std::vector<Row> ReadTable(const std::filesystem::path& path) {
  std::ifstream stream(path);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> keys = Split(line);
  std::vector<Row> rows;
  while (std::getline(stream, line)) {
    std::vector<std::string> fields = Split(line);
    fields.resize(keys.size());
    Row& row = rows.emplace_back();
    for (size_t i = 0; i < keys.size(); ++i) row[keys[i]] = fields[i];
  }
  return rows;
}

double Number(const Row& row, const std::string& key) { return std::stod(row.at(key)); }

Eigen::Vector3d Vector(const Row& row, const std::string& prefix) {
  return {Number(row, prefix + "_x"), Number(row, prefix + "_y"), Number(row, prefix + "_z")};
}

class RobotFacts : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path folder = ReferenceFolder();
    if (!std::filesystem::exists(folder / "atlas-joints.csv")) {
      GTEST_SKIP() << "NOT CHECKED: the tables atlas-joints.csv and atlas-links.csv are not in " << folder;
    }
    joints_ = ReadTable(folder / "atlas-joints.csv");
    links_ = ReadTable(folder / "atlas-links.csv");
  }
  const RobotModel& robot() const { return EmbeddedDataset()->robot(); }

  std::vector<Row> joints_;
  std::vector<Row> links_;
};

TEST_F(RobotFacts, JointsEqualTheTable) {
  ASSERT_EQ(robot().joints().size(), joints_.size());
  for (size_t j = 0; j < joints_.size(); ++j) {
    const Row& row = joints_[j];
    const Joint& joint = robot().joints()[j];
    EXPECT_EQ(joint.name, row.at("name"));
    EXPECT_EQ(joint.dof, row.at("dof_index").empty() ? -1 : std::stoi(row.at("dof_index"))) << joint.name;
    EXPECT_EQ(robot().links()[static_cast<size_t>(joint.parent_link)].name, row.at("parent")) << joint.name;
    EXPECT_EQ(robot().links()[static_cast<size_t>(joint.child_link)].name, row.at("child")) << joint.name;
    EXPECT_TRUE(joint.origin.translation().isApprox(Vector(row, "origin"), 1e-12) ||
                (joint.origin.translation() - Vector(row, "origin")).norm() < 1e-12)
        << joint.name;
    if (joint.dof < 0) continue;
    EXPECT_LT((joint.axis - Vector(row, "axis").normalized()).norm(), 1e-8) << joint.name;
    const bool limited = joint.type != JointType::kContinuous;
    EXPECT_EQ(limited, !row.at("lower_rad").empty()) << joint.name;
    if (!limited) continue;
    EXPECT_DOUBLE_EQ(joint.lower, Number(row, "lower_rad")) << joint.name;
    EXPECT_DOUBLE_EQ(joint.upper, Number(row, "upper_rad")) << joint.name;
  }
}

TEST_F(RobotFacts, LinksEqualTheTable) {
  ASSERT_EQ(robot().links().size(), links_.size());
  for (size_t i = 0; i < links_.size(); ++i) {
    const Link& link = robot().links()[i];
    EXPECT_EQ(link.name, links_[i].at("name"));
    EXPECT_DOUBLE_EQ(link.mass, Number(links_[i], "mass")) << link.name;
    EXPECT_LT((link.com - Vector(links_[i], "com")).norm(), 1e-12) << link.name;
  }
  EXPECT_NEAR(robot().total_mass(), 90.7776740, 1e-6);
}

TEST_F(RobotFacts, FeetHaveTheSoleOfTheTable) {
  for (const Contact& foot : EmbeddedDataset()->contacts()) {
    const Row& row = links_[static_cast<size_t>(foot.link_index)];
    EXPECT_LT((foot.box_L.min() - Vector(row, "aabb_min")).norm(), 1e-8) << foot.link;
    EXPECT_LT((foot.box_L.max() - Vector(row, "aabb_max")).norm(), 1e-8) << foot.link;
  }
}

TEST_F(RobotFacts, ShapesStayInsideTheBoundingBoxesOfTheTable) {
  for (size_t i = 0; i < links_.size(); ++i) {
    for (const ShapeSpec& shape : robot().links()[i].collision) {
      const TriangleMesh mesh = Tessellate(shape);
      for (const Eigen::Vector3d& point : mesh.vertices) {
        EXPECT_TRUE(((point - Vector(links_[i], "aabb_min")).array() > -1e-8).all() &&
                    ((Vector(links_[i], "aabb_max") - point).array() > -1e-8).all())
            << robot().links()[i].name << " at " << point.transpose();
      }
    }
  }
}

Eigen::VectorXd NominalConfiguration(const Dataset& dataset) {
  constexpr double kHighAboveTheScene_m = 100;
  Eigen::VectorXd x = Eigen::VectorXd::Zero(dataset.robot().configuration_size());
  const int n = dataset.robot().num_dofs();
  x.head(n) = dataset.nominal_joints();
  x[n + 2] = kHighAboveTheScene_m;
  x[n + 3] = 1;
  return x;
}

TEST(RobotShape, NoLinksTouchInTheReferencePose) {
  const CollisionModel& model = *EmbeddedDataset()->collision_model();
  const RobotModel& robot = EmbeddedDataset()->robot();
  const int num_links = static_cast<int>(robot.links().size());
  for (int b = 0; b < num_links; ++b) {
    for (int a = 0; a < b; ++a) {
      EXPECT_NE(model.pair_status(a, b), CollisionModel::PairStatus::kIgnoredReferencePose)
          << robot.links()[static_cast<size_t>(a)].name << ", " << robot.links()[static_cast<size_t>(b)].name;
    }
  }
  EXPECT_EQ(model.pairs(PairSelection::kReference), model.pairs(PairSelection::kAll));
  EXPECT_GT(model.checked_pairs().size(), 300u);
}

TEST(RobotShape, NominalPostureIsFreeOfSelfCollision) {
  const Dataset& dataset = *EmbeddedDataset();
  Kinematics kinematics(dataset.robot());
  kinematics.Update(NominalConfiguration(dataset));
  CollisionQuery query(dataset.collision_model());
  for (const ProximityPair& contact : query.Contacts(kinematics, 0.01)) {
    ADD_FAILURE() << dataset.robot().links()[static_cast<size_t>(contact.link_a)].name << " and link " << contact.link_b
                  << " are " << contact.distance_m << " m apart";
  }
  ExactCollision exact(dataset.robot(), dataset.scene(), dataset.collision_model());
  EXPECT_EQ(exact.SelfDepth(kinematics).strict_m, 0.0);
  EXPECT_EQ(exact.DeepestContainment(kinematics).depth_m, 0.0);
}

// The robot above, on and in the ground of every posture problem of this garage, as in garage_easier_test.cpp.
TEST(RobotShape, CullingChangesNoFigureAmongTheObstacles) {
  const Dataset& dataset = *EmbeddedDataset();
  ExactCollision culled(dataset.robot(), dataset.scene(), dataset.collision_model());
  ExactCollision exhaustive(dataset.robot(), dataset.scene(), dataset.collision_model(), Culling::kOff);
  Kinematics kinematics(dataset.robot());
  const int n = dataset.robot().num_dofs();
  int touching = 0, inside = 0;
  for (const ProblemDefinition& problem : dataset.problems(Task::kPosture)) {
    for (const double height_m : {0.9, 0.85, 0.5}) {
      Eigen::VectorXd x = NominalConfiguration(dataset);
      x.segment<3>(n) = problem.stances[0].contacts[0].position + Eigen::Vector3d(0, 0, height_m);
      kinematics.Update(x);
      const auto a = culled.DeepestEnvironmentContacts(kinematics),
                 b = exhaustive.DeepestEnvironmentContacts(kinematics);
      EXPECT_EQ(a.literal.depth_m, b.literal.depth_m) << problem.id;
      EXPECT_EQ(a.strict.depth_m, b.strict.depth_m) << problem.id;
      EXPECT_EQ(culled.SelfDepth(kinematics).strict_m, exhaustive.SelfDepth(kinematics).strict_m) << problem.id;
      const double depth_m = culled.DeepestContainment(kinematics).depth_m;
      EXPECT_EQ(depth_m, exhaustive.DeepestContainment(kinematics).depth_m) << problem.id;
      touching += a.strict.depth_m > 0.0 ? 1 : 0;
      inside += depth_m > 0.0 ? 1 : 0;
    }
  }
  EXPECT_GT(touching, 20);
  EXPECT_GT(inside, 20);
}

TEST(RobotShape, ArmsKneesAndHipsMoveFreely) {
  const Dataset& dataset = *EmbeddedDataset();
  const RobotModel& robot = dataset.robot();
  Kinematics kinematics(robot);
  CollisionQuery query(dataset.collision_model());
  constexpr int kSteps = 16;
  for (const char* name : {"l_arm_shx", "r_arm_shx", "l_arm_ely", "r_arm_ely", "l_arm_elx", "r_arm_elx", "l_leg_lhy",
                           "r_leg_lhy", "l_leg_kny", "r_leg_kny", "l_leg_uay", "r_leg_uay", "neck_ay"}) {
    const int dof = robot.joints()[static_cast<size_t>(robot.FindJoint(name))].dof;
    ASSERT_GE(dof, 0) << name;
    Eigen::VectorXd x = NominalConfiguration(dataset);
    for (int step = 0; step <= kSteps; ++step) {
      x[dof] = std::lerp(robot.lower_limits()[dof], robot.upper_limits()[dof], static_cast<double>(step) / kSteps);
      kinematics.Update(x);
      EXPECT_TRUE(query.Contacts(kinematics, 0.0).empty()) << name << " = " << x[dof];
    }
  }
}

}  // namespace
}  // namespace legopt
