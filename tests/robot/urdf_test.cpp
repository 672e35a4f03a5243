// Invalid robot descriptions are refused with the element, the value and the fix named.

#include <gtest/gtest.h>

#include <cmath>

#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"

namespace legopt {
namespace {

using ::testing::Test;

RobotModel Parse(const std::string& body) {
  return RobotModel::FromUrdfText("<robot name=\"r\">" + body + "</robot>", "robot.urdf", ".");
}

void ExpectFault(const std::string& body, const std::string& field, const std::string& message) {
  try {
    Parse(body);
    FAIL() << "accepted: " << body;
  } catch (const InputError& error) {
    EXPECT_EQ(error.fault().file, "robot.urdf");
    EXPECT_NE(error.fault().field.find(field), std::string::npos) << error.what();
    EXPECT_NE(error.fault().message.find(message), std::string::npos) << error.what();
    EXPECT_FALSE(error.fault().fix.empty()) << error.what();
  }
}

const std::string kLinks = R"(<link name="a"/><link name="b"/><link name="c"/>)";

std::string FixedJoint(const std::string& name, const std::string& parent, const std::string& child) {
  return "<joint name=\"" + name + "\" type=\"fixed\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/></joint>";
}

TEST(Urdf, TreeOrderFollowsTheFileNotTheNames) {
  const RobotModel model = Parse(kLinks + FixedJoint("zz", "a", "c") + FixedJoint("aa", "a", "b"));
  EXPECT_EQ(model.links()[1].name, "c");
  EXPECT_EQ(model.links()[2].name, "b");
  EXPECT_EQ(model.configuration_size(), 7);
}

TEST(Urdf, DepthFirstEvenWhenTheFileIsNot) {
  const RobotModel model = Parse(R"(<link name="d"/>)" + kLinks + FixedJoint("1", "a", "b") +
                                 FixedJoint("2", "a", "c") + FixedJoint("3", "b", "d"));
  EXPECT_EQ(model.links()[0].name, "a");
  EXPECT_EQ(model.links()[1].name, "b");
  EXPECT_EQ(model.links()[2].name, "d");
  EXPECT_EQ(model.links()[3].name, "c");
}

TEST(Urdf, Loops) {
  ExpectFault(kLinks + FixedJoint("1", "a", "b") + FixedJoint("2", "b", "c") + FixedJoint("3", "c", "a"), "<robot>",
              "loop");
  ExpectFault(kLinks + FixedJoint("1", "a", "b") + FixedJoint("2", "a", "c") + FixedJoint("3", "b", "c"), "link 'c'",
              "child of two joints");
  ExpectFault(kLinks + FixedJoint("1", "b", "c") + FixedJoint("2", "c", "b"), "link 'b'", "loop");
}

TEST(Urdf, MissingAndUnconnectedLinks) {
  ExpectFault(kLinks + FixedJoint("1", "a", "nowhere"), "joint '1'", "does not exist");
  ExpectFault(kLinks + FixedJoint("1", "a", "b"), "link 'c'", "not connected");
  ExpectFault("", "<robot>", "no links");
}

TEST(Urdf, BadJoints) {
  ExpectFault(R"(<link name="a"><collision><geometry><sphere radius="1"/></geometry></collision></link>)" +
                  std::string(R"(<link name="b"/><link name="c"/>)") + FixedJoint("0", "a", "b") +
                  R"(<joint name="1" type="floating"><parent link="b"/><child link="c"/></joint>)",
              "joint '1'", "only the joint of a root link");
  ExpectFault(kLinks + R"(<joint name="1" type="ball"><parent link="a"/><child link="b"/></joint>)", "joint '1'",
              "not supported");
  ExpectFault(R"(<link name="a"/><link name="b"/><joint name="1" type="revolute"><parent link="a"/><child link="b"/>
               <axis xyz="0 0 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>)",
              "joint '1'", "direction");
  ExpectFault(R"(<link name="a"/><link name="b"/><joint name="1" type="revolute"><parent link="a"/><child link="b"/>
               <axis xyz="0 0 1"/><limit lower="2" upper="1" effort="1" velocity="1"/></joint>)",
              "joint '1'", "lower must not");
  ExpectFault(kLinks + FixedJoint("1", "a", "b") + FixedJoint("1", "a", "c"), "joint", "two joints");
}

std::string Follower(const std::string& name, const std::string& parent, const std::string& child,
                     const std::string& mimic) {
  return "<joint name='" + name + "' type='revolute'><parent link='" + parent + "'/><child link='" + child +
         "'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/>" + mimic + "</joint>";
}

TEST(Urdf, AFollowerMovesWithItsLeader) {
  const RobotModel model = Parse(kLinks + Follower("1", "a", "b", "<mimic joint='2' multiplier='-2' offset='0.5'/>") +
                                 Follower("2", "b", "c", ""));
  ASSERT_EQ(model.num_dofs(), 1);
  EXPECT_EQ(DofNames(model), std::vector<std::string>{"2"});
  EXPECT_EQ(model.num_bodies(), 3);
  EXPECT_EQ(model.MovingJointsBetween(0, 2), 2);
  // -1 <= -2 q + 0.5 <= 1 and -1 <= q <= 1
  EXPECT_DOUBLE_EQ(model.lower_limits()[0], -0.25);
  EXPECT_DOUBLE_EQ(model.upper_limits()[0], 0.75);
  Kinematics kinematics(model);
  Eigen::VectorXd x = model.NeutralConfiguration();
  x[0] = 0.4;
  kinematics.Update(x);
  const auto angle = [&](int link) {
    return std::atan2(kinematics.link_pose(link).linear()(1, 0), kinematics.link_pose(link).linear()(0, 0));
  };
  EXPECT_NEAR(angle(1), -2 * 0.4 + 0.5, 1e-15);
  EXPECT_NEAR(angle(2), -2 * 0.4 + 0.5 + 0.4, 1e-15);
}

TEST(Urdf, AFollowerOfAFollowerHasTheSameLeader) {
  const RobotModel model = Parse(kLinks + Follower("1", "a", "b", "<mimic joint='2' multiplier='3' offset='0.1'/>") +
                                 Follower("2", "b", "c", "<mimic joint='3' multiplier='0.5' offset='0.2'/>") +
                                 "<link name='d'/>" + Follower("3", "c", "d", ""));
  EXPECT_EQ(model.num_dofs(), 1);
  EXPECT_DOUBLE_EQ(model.joints()[0].multiplier, 1.5);
  EXPECT_DOUBLE_EQ(model.joints()[0].offset, 3 * 0.2 + 0.1);
}

TEST(Urdf, BadFollowers) {
  const std::string other = Follower("2", "b", "c", "");
  ExpectFault(kLinks + Follower("1", "a", "b", "<mimic joint='none'/>") + other, "joint '1': mimic", "no such joint");
  ExpectFault(kLinks + Follower("1", "a", "b", "<mimic joint='2'/>") + Follower("2", "b", "c", "<mimic joint='1'/>"),
              "joint '1': mimic", "circle");
  ExpectFault(kLinks + Follower("1", "a", "b", "<mimic joint='2'/>") + FixedJoint("2", "b", "c"), "joint '1': mimic",
              "does not move");
  ExpectFault(kLinks + Follower("1", "a", "b", "<mimic joint='2' offset='5'/>") + other, "joint '2': limit",
              "no common value");
}

TEST(Urdf, MissingMeshAndBrokenXml) {
  ExpectFault(R"(<link name="a"><collision><geometry><mesh filename="gone.stl"/></geometry></collision></link>)",
              "link 'a': mesh", "no such mesh");
  EXPECT_THROW(RobotModel::FromUrdfText("<robot><link", "robot.urdf", "."), InputError);
  EXPECT_THROW(RobotModel::FromUrdfText("<model/>", "robot.urdf", "."), InputError);
  EXPECT_THROW(RobotModel::FromUrdfFile("no/such/file.urdf"), InputError);
}

TEST(Urdf, ReadsEveryShape) {
  const RobotModel model = Parse(R"(<link name="a">
    <collision><origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><geometry><box size="1 2 3"/></geometry></collision>
    <collision><geometry><sphere radius="0.4"/></geometry></collision>
    <collision><geometry><cylinder radius="0.2" length="0.7"/></geometry></collision></link>)");
  const auto& shapes = model.links()[0].collision;
  ASSERT_EQ(shapes.size(), 3u);
  EXPECT_EQ(shapes[0].kind, ShapeSpec::Kind::kBox);
  EXPECT_LT((shapes[0].pose * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(), 1e-12);
  EXPECT_EQ(shapes[1].kind, ShapeSpec::Kind::kSphere);
  EXPECT_DOUBLE_EQ(shapes[1].size.x(), 0.4);
  EXPECT_EQ(shapes[2].kind, ShapeSpec::Kind::kCylinder);
  EXPECT_DOUBLE_EQ(shapes[2].size.z(), 0.7);
}

}  // namespace
}  // namespace legopt
