// Policy: a robot read from COLLADA equals the robot described by its URDF. Errors in the file are reported with their
// line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/dataset/dataset.h"
#include "legopt/import/internal/collada_robot.h"
#include "legopt/import/internal/copied_robot.h"
#include "legopt/math/random_numbers.h"
#include "legopt/robot/kinematics.h"
#include "tests/dataset/synthetic_dataset.h"
#include "tests/import/clone_folder.h"

namespace legopt {
namespace {

using test::ImportTestFile;
using test::MessageOf;
using testing::AllOf;
using testing::HasSubstr;

RobotModel ImportedRobot(const std::filesystem::path& collada, const std::filesystem::path& folder) {
  WriteColladaRobot(ReadColladaRobot(collada), folder);
  return RobotModel::FromUrdfFile((folder / kRobotFileName).string());
}

Eigen::VectorXd RandomConfiguration(const RobotModel& robot, std::mt19937_64& generator) {
  Eigen::VectorXd x(robot.configuration_size());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = 2.0 * UniformRandom(generator) - 1.0;
  return x;
}

void ExpectSameKinematics(const RobotModel& a, const RobotModel& b) {
  constexpr double kRounding = 1e-8;  // the file has nine digits
  Kinematics ka(a), kb(b);
  std::mt19937_64 generator(1);
  for (int sample = 0; sample < 20; ++sample) {
    const Eigen::VectorXd x = RandomConfiguration(a, generator);
    ka.Update(x);
    kb.Update(x);
    EXPECT_LT((ka.com() - kb.com()).norm(), kRounding);
    for (int link = 0; link < std::ssize(a.links()); ++link) {
      const int other = b.FindLink(a.links()[static_cast<size_t>(link)].name);
      ASSERT_GE(other, 0);
      EXPECT_TRUE(ka.link_pose(link).isApprox(kb.link_pose(other), kRounding)) << link;
    }
  }
}

class Collada : public testing::Test {
 protected:
  /// Returns the message of the error after `from` is replaced by `to` in the file.
  std::string ErrorWith(const std::string& from, const std::string& to) {
    const std::filesystem::path file = folder_.path() / "changed.dae";
    std::string text = test::ReadText(ImportTestFile("tiny.dae"));
    const size_t position = text.find(from);
    EXPECT_NE(position, std::string::npos) << from;
    test::WriteText(file, text.replace(position, from.size(), to));
    return MessageOf([&] { ReadColladaRobot(file); });
  }

  test::TemporaryFolder folder_;
};

TEST_F(Collada, IsTheRobotOfTheUrdf) {
  const test::SyntheticFolder synthetic(folder_.path() / "synthetic");
  const RobotModel expected = RobotModel::FromUrdfFile((synthetic.path() / "robot.urdf").string());
  const RobotModel robot = ImportedRobot(ImportTestFile("tiny.dae"), folder_.path() / "imported");
  EXPECT_EQ(robot.name(), "tiny");
  ASSERT_EQ(robot.num_dofs(), expected.num_dofs());
  for (int dof = 0; dof < robot.num_dofs(); ++dof) {
    const Joint& joint = robot.joints()[static_cast<size_t>(robot.dof_joint(dof))];
    const Joint& other = expected.joints()[static_cast<size_t>(expected.dof_joint(dof))];
    EXPECT_EQ(joint.name, other.name) << "the order of the tree, not the alphabetical one of the joints";
    EXPECT_EQ(joint.type, other.type) << joint.name;
    if (joint.type == JointType::kContinuous) continue;
    EXPECT_NEAR(joint.lower, other.lower, 1e-9) << joint.name;
    EXPECT_NEAR(joint.upper, other.upper, 1e-9) << joint.name;
  }
  ASSERT_EQ(robot.links().size(), expected.links().size());
  EXPECT_NEAR(robot.total_mass(), expected.total_mass(), 1e-12);
  ExpectSameKinematics(expected, robot);
}

TEST_F(Collada, MeshesStandWhereTheShapesOfTheUrdfStand) {
  const test::SyntheticFolder synthetic(folder_.path() / "synthetic");
  const RobotModel expected = RobotModel::FromUrdfFile((synthetic.path() / "robot.urdf").string());
  const RobotModel robot = ImportedRobot(ImportTestFile("tiny.dae"), folder_.path() / "imported");
  for (const Link& link : expected.links()) {
    const Link& other = robot.links()[static_cast<size_t>(robot.FindLink(link.name))];
    ASSERT_EQ(other.collision.size(), link.collision.size()) << link.name;
    if (link.collision.empty()) continue;
    const Eigen::AlignedBox3d box = LinkBox(link), found = LinkBox(other);
    EXPECT_LT((box.min() - found.min()).norm() + (box.max() - found.max()).norm(), 1e-6) << link.name;
  }
}

TEST_F(Collada, EffortAndVelocityAndInertiaAreKept) {
  const ColladaRobot robot = ReadColladaRobot(ImportTestFile("tiny.dae"));
  const auto hip = std::find_if(robot.joints.begin(), robot.joints.end(),
                                [](const ColladaJoint& joint) { return joint.joint.name == "l_hip"; });
  ASSERT_NE(hip, robot.joints.end());
  EXPECT_EQ(hip->effort, 30);  // called acceleration in the file
  EXPECT_EQ(hip->velocity, 12);
  // Principal moments 1, 2, 3 about axes rotated by rpy 0.5 0.3 0.2: the file has the transposed rotation.
  const Eigen::Matrix3d axes =
      (Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  const Eigen::Matrix3d expected = axes * Eigen::Vector3d(1, 2, 3).asDiagonal() * axes.transpose();
  EXPECT_TRUE(robot.links.front().inertia.isApprox(expected, 1e-7)) << robot.links.front().inertia;
}

TEST_F(Collada, AnArchiveHoldsTheSameRobot) {
  const ColladaRobot plain = ReadColladaRobot(ImportTestFile("tiny.dae"));
  const ColladaRobot packed = ReadColladaRobot(ImportTestFile("clone/robots/tiny.zae"));
  ASSERT_EQ(plain.links.size(), packed.links.size());
  WriteColladaRobot(plain, folder_.path() / "plain");
  WriteColladaRobot(packed, folder_.path() / "packed");
  EXPECT_EQ(test::ReadText(folder_.path() / "plain" / kRobotFileName),
            test::ReadText(folder_.path() / "packed" / kRobotFileName));
}

TEST_F(Collada, LengthsAreConvertedToMetres) {
  const std::filesystem::path file = folder_.path() / "centimetres.dae";
  std::filesystem::copy(ImportTestFile("tiny.dae"), file);
  test::ReplaceInFile(file, "meter=\"1\"", "meter=\"0.01\"");
  const ColladaRobot metres = ReadColladaRobot(ImportTestFile("tiny.dae"));
  const ColladaRobot centimetres = ReadColladaRobot(file);
  for (size_t k = 0; k < metres.links.size(); ++k) {
    EXPECT_TRUE((0.01 * metres.links[k].pose.translation()).isApprox(centimetres.links[k].pose.translation(), 1e-12));
    EXPECT_TRUE((0.01 * metres.links[k].com).isApprox(centimetres.links[k].com, 1e-9));
  }
  EXPECT_NEAR(centimetres.links.front().geometries.front().mesh.vertices.front().x(), -0.001, 1e-12);
}

TEST_F(Collada, APassiveJointIsFixedAndSaid) {
  const std::filesystem::path file = folder_.path() / "passive.dae";
  std::string text = test::ReadText(ImportTestFile("tiny.dae"));
  const size_t info = text.find("axis=\"kmodel0/l_shoulder/axis0\"");
  text.replace(text.find("true", info), 4, "false");
  test::WriteText(file, text);
  const ColladaRobot robot = ReadColladaRobot(file);
  ASSERT_EQ(robot.findings.size(), 1U);
  EXPECT_EQ(robot.findings.front().field, "joint 'l_shoulder'");
  EXPECT_EQ(robot.findings.front().severity, DatasetDiagnostic::Severity::kWarning);
}

TEST_F(Collada, FaultsAreNamedWithTheirLine) {
  EXPECT_THAT(ErrorWith("Z_UP", "Y_UP"), AllOf(HasSubstr("changed.dae"), HasSubstr("line 9"), HasSubstr("z up")));
  EXPECT_THAT(ErrorWith("meter=\"1\"", "meter=\"-1\""), HasSubstr("unit of length"));
  EXPECT_THAT(ErrorWith("joint=\"kmodel0/l_hip\"", "joint=\"kmodel0/l_hop\""),
              AllOf(HasSubstr("l_hop"), HasSubstr("no such joint"), HasSubstr("attachment_full")));
  EXPECT_THAT(ErrorWith("url=\"#gkmodel0_head_geom0\"", "url=\"#nothing\""), HasSubstr("no such geometry"));
  EXPECT_THAT(ErrorWith("<p>0 2 3 1", "<p>0 2 3 99"), HasSubstr("no such vertex"));
  EXPECT_THAT(ErrorWith("<axis>0 1 0</axis>", "<axis>0 0 0</axis>"), HasSubstr("no direction"));
  EXPECT_THAT(ErrorWith("<axis>0 1 0</axis>", "<axis>0 1</axis>"), HasSubstr("needs 3 numbers"));
  EXPECT_THAT(ErrorWith("<axis>0 1 0</axis>", "<axis>0 one 0</axis>"), HasSubstr("not a finite number"));
  EXPECT_THAT(ErrorWith("attachment_full", "attachment_start"), testing::Not(testing::IsEmpty()));
  EXPECT_THAT(ErrorWith("</COLLADA>", ""), HasSubstr("not valid XML"));
  EXPECT_THAT(ErrorWith("<kinematics_model ", "<other_model "), testing::Not(testing::IsEmpty()));
  EXPECT_THAT(ErrorWith("name=\"trunk\" sid=\"node9\"", "name=\"truck\" sid=\"node9\""), HasSubstr("base link"));
  EXPECT_THAT(ErrorWith("<mass>10</mass>", "<mass>-10</mass>"), HasSubstr("negative"));
  EXPECT_THAT(MessageOf([&] { ReadColladaRobot(folder_.path() / "nothing.zae"); }), HasSubstr("cannot be read"));
  test::WriteText(folder_.path() / "no-archive.zae", "text");
  EXPECT_THAT(MessageOf([&] { ReadColladaRobot(folder_.path() / "no-archive.zae"); }), HasSubstr("zip archive"));
}

}  // namespace
}  // namespace legopt
