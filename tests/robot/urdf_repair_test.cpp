// Policy: a fault that would make results meaningless is refused, one that cannot affect them is repaired with a note,
// and one run reports all faults.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "legopt/robot/internal/urdf_check.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/robot/urdf_expectations.h"

namespace legopt {
namespace {

using test::ExpectNoted;
using test::ExpectRefused;
using testing::AllOf;
using testing::HasSubstr;

TEST(UrdfRepair, SizesAreSizes) {
  const auto in_collision = [](const std::string& shape) {
    return "<robot name='r'><link name='a'><collision><geometry>" + shape + "</geometry></collision></link></robot>";
  };
  for (const char* shape : {"<box size='1 -1 1'/>", "<sphere radius='-1'/>", "<cylinder radius='0' length='1'/>",
                            "<cylinder radius='1' length='-1'/>", "<mesh filename='a.stl' scale='1 0 1'/>"}) {
    ExpectRefused(in_collision(shape), {"link 'a'", "collision: geometry"}, shape);
  }
  for (const char* shape : {"<cone/>", "<box size='1 1 1'/><sphere radius='1'/>"}) {
    ExpectRefused(in_collision(shape), {"link 'a'", "collision: geometry"}, shape);
  }
  for (const char* shape :
       {"<box size='0 1 1'/>", "<sphere radius='0'/>", "", "<box size='1 1 1'/><declare_convex/>"}) {
    ExpectNoted(in_collision(shape), shape);
  }
  const RobotModel flat = RobotModel::FromUrdfText(in_collision("<box size='0 1 1'/>"), "robot.urdf", ".");
  EXPECT_EQ(flat.links()[0].collision[0].size, Eigen::Vector3d(0.001, 1, 1));
  const RobotModel capsule =
      RobotModel::FromUrdfText(in_collision("<capsule radius='1' length='2'/>"), "robot.urdf", ".");
  EXPECT_EQ(capsule.links()[0].collision[0].kind, ShapeSpec::Kind::kCapsule);
  EXPECT_EQ(capsule.links()[0].collision[0].size, Eigen::Vector3d(1, 1, 2));
  ExpectRefused(
      "<robot name='r'><link name='a'><inertial><mass value='-1'/><inertia ixx='1' ixy='0' ixz='0' iyy='1' "
      "iyz='0' izz='1'/></inertial></link></robot>",
      {"link 'a'", "mass", "value"}, "negative mass");
}

std::string JointXml(const std::string& type, const std::string& inside, const std::string& parent = "a") {
  return "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='" + type + "'><parent link='" + parent +
         "'/><child link='b'/><axis xyz='0 0 1'/>" + inside + "</joint></robot>";
}

TEST(UrdfRepair, InfiniteLimitsAreNoLimits) {
  const std::string xml = JointXml("revolute", "<limit lower='-inf' upper='INFINITY' effort='inf' velocity='1'/>");
  ExpectNoted(xml, "infinite");
  const RobotModel robot = RobotModel::FromUrdfText(xml, "robot.urdf", ".");
  EXPECT_EQ(robot.lower_limits()[0], -1e4);
  EXPECT_EQ(robot.upper_limits()[0], 1e4);
}

TEST(UrdfRepair, AFreeRootIsLeftOut) {
  for (const char* type : {"floating", "planar"}) {
    ExpectNoted(JointXml(type, ""), type);
    EXPECT_EQ(RobotModel::FromUrdfText(JointXml(type, ""), "robot.urdf", ".").links().front().name, "b");
  }
  const std::string shaped = "<link name='a'><collision><geometry><sphere radius='1'/></geometry></collision></link>";
  std::string xml = JointXml("floating", "");
  xml.replace(xml.find("<link name='a'/>"), 16, shaped);
  ExpectRefused(xml, {"joint 'j'", "type"}, "a root with a shape");
}

TEST(UrdfRepair, EverythingAboveAFreeJointIsLeftOutIfItIsBare) {
  const std::string above =
      "<link name='world'/><link name='stand'><inertial><mass value='0'/></inertial></link>"
      "<joint name='stands' type='fixed'><parent link='world'/><child link='stand'/></joint>"
      "<joint name='free' type='floating'><parent link='stand'/><child link='base'/></joint><link name='base'>";
  const auto robot = [&](const std::string& rest) {
    return RobotModel::FromUrdfText("<robot name='r'>" + above + rest + "</link></robot>", "robot.urdf", ".");
  };
  EXPECT_EQ(robot("").links().size(), 1U);
  const std::string heavy = "<inertial><mass value='0'/></inertial>";
  std::string with_mass = above;
  with_mass.replace(with_mass.find(heavy), heavy.size(), "<inertial><mass value='2'/></inertial>");
  EXPECT_THAT(test::MessageOf([&] {
                RobotModel::FromUrdfText("<robot name='r'>" + with_mass + "</link></robot>", "robot.urdf", ".");
              }),
              testing::HasSubstr("only the joint of a root link"));
}

TEST(UrdfRepair, AllFaultsAtOnceAtMostThreeOfAKind) {
  std::string xml = "<robot name='r'>";
  for (int i = 0; i < 5; ++i) {
    xml += "<link name='" + std::to_string(i) + "'><inertial><mass value='-1'/><inertia/></inertial></link>";
  }
  try {
    CheckUrdf(xml + "</robot>", "robot.urdf");
    FAIL() << "accepted";
  } catch (const InputError& error) {
    std::map<std::string, int> lines;
    for (const InputError::Fault& fault : error.faults()) ++lines[fault.message];
    EXPECT_EQ(lines["must not be negative"], 3);
    EXPECT_GT(lines.size(), 3U) << "missing moments of inertia, too";
    EXPECT_THAT(error.what(), HasSubstr("and 2 more"));
  }
}

TEST(UrdfRepair, ContinuousJointsHaveNoLimits) {
  const auto remarks = ReviewUrdf(
      CheckUrdf(JointXml("continuous", "<limit lower='-1' upper='1' effort='1' velocity='1'/>"), "robot.urdf"));
  ASSERT_EQ(remarks.size(), 1U);
  EXPECT_EQ(remarks[0].field, "j");
  EXPECT_THAT(remarks[0].message, HasSubstr("continuous"));
}

// Each of these removed mass or collision geometry from the robot of garage-small, or crashed the program.
struct Edit {
  const char* from;
  const char* to;
  const char* element;
};

void PrintTo(const Edit& edit, std::ostream* out) { *out << edit.to; }

class BrokenLink : public testing::TestWithParam<Edit> {};

TEST_P(BrokenLink, IsAnError) {
  std::string xml = ReadUrdfFile(SourceFolder() + "/data/garage-small/robot.urdf");
  const std::size_t link = xml.find("<link name=\"pelvis\"");
  ASSERT_NE(link, std::string::npos);
  const std::size_t place = xml.find(GetParam().from, link);
  ASSERT_NE(place, std::string::npos) << GetParam().from;
  xml.replace(place, std::string(GetParam().from).size(), GetParam().to);
  ExpectRefused(xml, {"link 'pelvis'", GetParam().element}, GetParam().to);
}

constexpr const char* kOrigin = R"(<origin xyz="0.0111 0 0.0271"/>)";
constexpr const char* kMass = R"(<mass value="14.2529"/>)";
constexpr const char* kVisual = R"(<geometry><box size="0.26 0.09 0.08"/></geometry>
    </visual>)";
constexpr const char* kCollision = R"(<origin xyz="0 0.115 0.08"/>
      <geometry><box size="0.26 0.09 0.08"/></geometry>
    </collision>)";

INSTANTIATE_TEST_SUITE_P(
    Urdf, BrokenLink,
    testing::Values(
        Edit{kOrigin, R"(<origin xyz="0 0"/>)", "inertial: origin: xyz"},
        Edit{kMass, R"(<mass value="14,2"/>)", "inertial: mass: value"},
        Edit{kMass, R"(<mass value="abc"/>)", "inertial: mass: value"},
        Edit{kMass, R"(<mass value="${m}"/>)", "inertial: mass: value"},
        Edit{kMass, R"(<mass value="x %n%n%n"/>)", "inertial: mass: value"},
        Edit{kMass, R"(<mass value="%s%s%s%s%s%s"/>)", "inertial: mass: value"},
        Edit{R"(<inertia ixx="0.124241386")", "<inertia", "inertial: inertia: ixx"},
        Edit{kCollision, R"(<geometry><box size="1 2"/></geometry></collision>)", "collision: geometry: box: size"},
        Edit{kCollision, R"(<geometry><box size="1 2 3 4"/></geometry></collision>)", "collision: geometry: box: size"},
        Edit{kCollision, R"(<origin xyz="0 0"/><geometry><box size="1 2 3"/></geometry></collision>)",
             "collision: origin: xyz"},
        Edit{kCollision, R"(<origin xyz="a b c"/><geometry><box size="1 2 3"/></geometry></collision>)",
             "collision: origin: xyz"},
        Edit{kCollision, R"(<origin xyz="%s%s%s %n %n"/><geometry><box size="1 2 3"/></geometry></collision>)",
             "collision: origin: xyz"}));

// Edits after which the robot is still usable, with a note.
class TolerableLink : public testing::TestWithParam<Edit> {};

TEST_P(TolerableLink, IsNoted) {
  std::string xml = ReadUrdfFile(SourceFolder() + "/data/garage-small/robot.urdf");
  const std::size_t place = xml.find(GetParam().from, xml.find("<link name=\"pelvis\""));
  ASSERT_NE(place, std::string::npos) << GetParam().from;
  xml.replace(place, std::string(GetParam().from).size(), GetParam().to);
  const std::vector<UrdfDiagnostic> notes = CheckUrdf(xml, "robot.urdf").notes;
  ASSERT_EQ(notes.size(), 1U);
  EXPECT_THAT(notes[0].field, AllOf(HasSubstr("link 'pelvis'"), HasSubstr(GetParam().element)));
}

INSTANTIATE_TEST_SUITE_P(
    Urdf, TolerableLink,
    testing::Values(Edit{kVisual, "<geometry/></visual>", "visual"},
                    Edit{kVisual, R"(<geometry><cylinder radius="0.1"/></geometry></visual>)", "visual: geometry"},
                    Edit{kVisual, R"(<geometry><box size="1 2"/></geometry></visual>)", "visual: geometry"},
                    Edit{kCollision, "<geometry/></collision>", "collision"},
                    Edit{kCollision, "</collision>", "collision"}));

}  // namespace
}  // namespace legopt
