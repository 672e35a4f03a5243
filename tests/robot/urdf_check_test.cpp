// Policy: every checked attribute and element of a URDF is corrupted in many ways, one at a time, in a robot that has
// them all. Each time the file is refused, and the error names the link or joint, the element, the attribute and a
// fix; or the fault is in a part that nothing reads or that can be repaired, and a note says so. A valid file is read
// bit by bit as urdfdom reads it.
#include "legopt/robot/internal/urdf_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <filesystem>
#include <limits>
#include <map>
#include <set>

#include "app/isolated_call.h"
#include "legopt/robot/internal/urdf_rules.h"
#include "legopt/robot/robot_model.h"
#include "legopt/types/input_error.h"
#include "tests/folders.h"
#include "tests/robot/complete_urdf.h"
#include "tests/robot/urdf_expectations.h"

namespace legopt {
namespace {

using test::ExpectNoted;
using test::ExpectRefused;
using test::FaultOf;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using tinyxml2::XMLElement;

// Whether nothing of the element at this path is read.
bool IsUnread(const std::string& path) {
  for (const char* part : {"/visual", "/material", "/dynamics", "/safety_controller", "/calibration"}) {
    if (path.find(part) != std::string::npos) return true;
  }
  return false;
}

// One element of the complete robot.
struct Place {
  std::size_t index = 0;
  std::string path;                     // begins at <robot>
  std::string owner;                    // "link 'trunk'"
  std::vector<std::string> attributes;  // attributes that it has
};

std::vector<Place> Places() {
  tinyxml2::XMLDocument document;
  document.Parse(test::kCompleteUrdf);
  std::vector<XMLElement*> elements;
  test::CollectElements(document.RootElement(), &elements);
  std::vector<Place> places;
  std::string owner = "robot";
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const std::string name = elements[i]->Name();
    if (elements[i]->Parent() == document.RootElement()) owner = name + " '" + elements[i]->Attribute("name") + "'";
    Place place{.index = i, .path = test::PathOf(*elements[i]), .owner = owner, .attributes = {}};
    for (auto* a = elements[i]->FirstAttribute(); a != nullptr; a = a->Next()) place.attributes.emplace_back(a->Name());
    places.push_back(place);
  }
  return places;
}

void PrintTo(const Place& place, std::ostream* out) { *out << place.path << " of " << place.owner; }

std::string NameOf(const testing::TestParamInfo<Place>& info) {
  std::string name = std::to_string(info.index) + "_" + info.param.path;
  std::replace(name.begin(), name.end(), '/', '_');
  return name;
}

class EveryElement : public testing::TestWithParam<Place> {
 protected:
  // Faults of unread elements are notes; others are errors.
  void ExpectHandled(const std::string& path, const std::string& xml, const std::vector<std::string>& in_field,
                     const std::string& what) const {
    if (IsUnread(path)) {
      ExpectNoted(xml, what);
    } else {
      ExpectRefused(xml, in_field, what);
    }
  }
  std::string element() const { return GetParam().path.substr(GetParam().path.find_last_of('/') + 1); }
  std::string With(const test::Spoil& spoil) const { return test::WithCorruptedElement(GetParam().index, spoil); }
  // Returns the words that an error about this element's attribute must contain.
  std::vector<std::string> About(const std::string& attribute) const {
    if (attribute == "name" && (element() == "link" || element() == "joint")) return {element(), attribute};
    return {GetParam().owner, element(), attribute};
  }
};

INSTANTIATE_TEST_SUITE_P(Urdf, EveryElement, testing::ValuesIn(Places()), NameOf);

// Number of values in an attribute; 0 for a text.
const std::map<std::string, int> kNumbers = {{"xyz", 3},
                                             {"rpy", 3},
                                             {"value", 1},
                                             {"ixx", 1},
                                             {"ixy", 1},
                                             {"ixz", 1},
                                             {"iyy", 1},
                                             {"iyz", 1},
                                             {"izz", 1},
                                             {"size", 3},
                                             {"radius", 1},
                                             {"length", 1},
                                             {"scale", 3},
                                             {"rgba", 4},
                                             {"lower", 1},
                                             {"upper", 1},
                                             {"effort", 1},
                                             {"velocity", 1},
                                             {"damping", 1},
                                             {"friction", 1},
                                             {"rising", 1},
                                             {"falling", 1},
                                             {"multiplier", 1},
                                             {"offset", 1},
                                             {"k_position", 1},
                                             {"k_velocity", 1},
                                             {"reference_position", 1},
                                             {"soft_lower_limit", 1},
                                             {"soft_upper_limit", 1}};

std::string Repeated(const std::string& word, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) text += (i == 0 ? "" : " ") + word;
  return text;
}

TEST_P(EveryElement, NumbersAreDecimalFiniteAndAsManyAsNeeded) {
  const std::vector<std::string> words = {
      "abc",  "14,2",  "${m}", "$(arg m)", "nan",    "inf",          "-inf",     "INFINITY",   "1e999", "1e-999",
      "0x10", "1.2.3", "1e",   "--1",      "+-1",    "++1",          "12deg",    "45\xC2\xB0", "1d3",   "1;",
      "1f",   "1_000", ".",    "-",        "%n%n%n", "%s%s%s%s%s%s", "x %n%n%n", "1%"};
  for (const std::string& attribute : GetParam().attributes) {
    const auto numbers = kNumbers.find(attribute);
    if (numbers == kNumbers.end()) continue;
    const int count = numbers->second;
    std::vector<std::string> bad = {"", " ", "\t\n", Repeated("0.5", count + 1)};
    if (count > 1) bad.push_back(Repeated("0.5", count - 1));
    if (count > 1) bad.push_back("0.5,0.5,0.5");
    for (const std::string& word : words) {
      bad.push_back(Repeated(word, count));
      bad.push_back(Repeated("0.5", count - 1) + " " + word);
    }
    for (const std::string& text : bad) {
      const bool infinite = text.find("inf") != std::string::npos || text.find("INF") != std::string::npos;
      if (infinite && element() == "limit") continue;  // see InfiniteLimitsAreNoLimits
      ExpectHandled(GetParam().path, With([&](XMLElement& e) { e.SetAttribute(attribute.c_str(), text.c_str()); }),
                    About(attribute), GetParam().path + " " + attribute + "=\"" + text + "\"");
    }
  }
}

TEST_P(EveryElement, NamesArePlainText) {
  const std::set<std::string> unread = {"robot/link/visual", "robot/link/collision"};  // names without references
  if (unread.contains(GetParam().path)) return;
  for (const std::string& attribute : GetParam().attributes) {
    if (kNumbers.contains(attribute)) continue;
    for (const std::string& text : {std::string(), std::string("a\nb"), std::string("\x1b[31m"), std::string("${name}"),
                                    std::string(5000, 'x')}) {
      const std::string xml = With([&](XMLElement& e) { e.SetAttribute(attribute.c_str(), text.c_str()); });
      const bool nameless_robot = GetParam().path == "robot" && attribute == "name" && text.empty();
      if (IsUnread(GetParam().path) || attribute == "version" || nameless_robot) {
        ExpectNoted(xml, GetParam().path + " " + attribute);
        continue;
      }
      EXPECT_FALSE(FaultOf(xml).message.empty()) << GetParam().path << " " << attribute << ": " << text.substr(0, 20);
      EXPECT_THAT(FaultOf(xml).field, Not(HasSubstr("\x1b"))) << "reaches the terminal";
      EXPECT_THAT(FaultOf(xml).value, Not(HasSubstr("\x1b"))) << "reaches the terminal";
    }
  }
}

// Attributes that are optional in the format.
const std::set<std::string> kOptional = {"xyz",
                                         "rpy",
                                         "scale",
                                         "lower",
                                         "upper",
                                         "damping",
                                         "friction",
                                         "rising",
                                         "falling",
                                         "version",
                                         "soft_lower_limit",
                                         "soft_upper_limit",
                                         "k_position",
                                         "multiplier",
                                         "offset",
                                         "reference_position"};

TEST_P(EveryElement, AttributesAreNeitherMissingNorMisspeltNorTwice) {
  for (const std::string& attribute : GetParam().attributes) {
    const bool shape_name = attribute == "name" && (element() == "visual" || element() == "collision");
    const bool optional = shape_name || (kOptional.contains(attribute) && element() != "axis");
    const std::string what = GetParam().path + " " + attribute;
    const std::string without = With([&](XMLElement& e) { e.DeleteAttribute(attribute.c_str()); });
    const bool robot_name = GetParam().path == "robot" && attribute == "name";
    const bool repaired = robot_name || attribute == "effort" || attribute == "velocity";
    if (repaired || (IsUnread(GetParam().path) && !optional)) {
      ExpectNoted(without, what + " missing");
    } else if (optional) {
      EXPECT_EQ(FaultOf(without).message, "") << what;
    } else {
      ExpectRefused(without, {element(), attribute}, what + " missing");
    }
    const std::string misspelt = With([&](XMLElement& e) {
      e.SetAttribute((attribute + "s").c_str(), e.Attribute(attribute.c_str()));
      e.DeleteAttribute(attribute.c_str());
    });
    if (robot_name) {
      ExpectNoted(misspelt, what + " misspelt");
    } else {
      ExpectHandled(GetParam().path, misspelt, {element()}, what + " misspelt");
    }
    const std::string marked = With([&](XMLElement& e) { e.SetAttribute("MARK", 1); });
    std::string twice = marked;
    twice.replace(twice.find("MARK=\"1\""), 8, attribute + "=\"1\"");
    ExpectRefused(twice, {}, what + " twice");
  }
}

TEST_P(EveryElement, ElementsAreNeitherTwiceNorMisspelt) {
  const std::set<std::string> repeatable = {"robot/material", "robot/link", "robot/joint", "robot/link/visual",
                                            "robot/link/collision"};
  if (GetParam().path == "robot") return;  // see WholeFiles
  if (!repeatable.contains(GetParam().path)) {
    const std::string twice =
        With([](XMLElement& e) { e.Parent()->InsertAfterChild(&e, e.DeepClone(e.GetDocument())); });
    if (GetParam().path.find("/collision/geometry/") != std::string::npos) {
      ExpectRefused(twice, {GetParam().owner}, GetParam().path + " twice");
    } else {
      ExpectNoted(twice, GetParam().path + " twice");
    }
  }
  const std::string misspelt = With([&](XMLElement& e) { e.SetName((element() + "x").c_str()); });
  const std::string parent = GetParam().path.substr(0, GetParam().path.find_last_of('/'));
  if (IsUnread(parent)) {
    ExpectNoted(misspelt, GetParam().path + " misspelt");
    return;
  }
  ExpectRefused(misspelt, {}, GetParam().path + " misspelt");
  EXPECT_THAT(FaultOf(misspelt).fix, AllOf(HasSubstr("did you mean"), HasSubstr(element()))) << FaultOf(misspelt).fix;
}

TEST_P(EveryElement, XacroIsNotTakenForNothing) {
  const std::string xml = With([](XMLElement& e) { e.InsertNewChildElement("xacro:insert_block"); });
  if (IsUnread(GetParam().path) || GetParam().path == "robot") {
    ExpectNoted(xml, GetParam().path);
    return;
  }
  EXPECT_THAT(FaultOf(xml).message, HasSubstr("xacro")) << GetParam().path;
  EXPECT_THAT(FaultOf(xml).fix, HasSubstr("xacro FILE")) << GetParam().path;
}

TEST(UrdfCheck, TheCompleteRobotIsCompleteAndSound) {
  EXPECT_EQ(FaultOf(test::kCompleteUrdf).message, "");
  std::map<std::string, std::set<std::string>> present;
  for (const Place& place : Places()) present[place.path].insert(place.attributes.begin(), place.attributes.end());
  const std::function<void(const UrdfElementRule&, const std::string&)> look = [&](const UrdfElementRule& rule,
                                                                                   const std::string& path) {
    if (!rule.refusal.empty()) return;
    EXPECT_TRUE(present.contains(path)) << path;
    for (const UrdfAttributeRule& attribute : rule.attributes) {
      if (!attribute.refusal.empty()) continue;
      EXPECT_TRUE(present[path].contains(std::string(attribute.name))) << path << " " << attribute.name;
    }
    for (const UrdfElementRule& child : rule.children) look(child, path + "/" + std::string(child.name));
  };
  look(UrdfRobotRule(), "robot");
}

// Required elements, by their paths.
TEST(UrdfCheck, RequiredElements) {
  const std::set<std::string> required = {"robot/link/inertial/mass", "robot/joint/parent", "robot/joint/child"};
  const std::set<std::string> repaired = {"robot/link/inertial/inertia", "robot/link/visual/geometry",
                                          "robot/link/collision/geometry"};
  for (const Place& place : Places()) {
    const bool limit = place.path == "robot/joint/limit";
    const bool shape = place.path.find("/geometry/") != std::string::npos;
    const bool noted = repaired.contains(place.path) || shape;
    if (!required.contains(place.path) && !limit && !noted) continue;
    const std::string xml = test::WithCorruptedElement(place.index, [](XMLElement& e) { e.Parent()->DeleteChild(&e); });
    if (noted) {
      ExpectNoted(xml, "without " + place.path);
      continue;
    }
    ExpectRefused(xml, {place.owner}, "without " + place.path);
  }
}

TEST(UrdfCheck, WholeFiles) {
  EXPECT_THAT(FaultOf("").message, HasSubstr("XML"));
  EXPECT_THAT(FaultOf(std::string("<robot name='r'>\0</robot>", 25)).message, HasSubstr("byte 0"));
  EXPECT_THAT(FaultOf("<robot name='r'><link name='a'/></robot><robot name='s'/>").message, HasSubstr("second"));
  EXPECT_THAT(FaultOf("<sdf/>").message, HasSubstr("<robot>"));
  ExpectNoted("<robot name='r' version='2.0'><link name='a'/></robot>", "version");
  EXPECT_THAT(FaultOf("<robot name='r'><link name='a'/><link name='a'/></robot>").message, HasSubstr("two links"));
  std::string many = "<robot name='r'>";
  for (int i = 0; i < 2001; ++i) many += "<link name='" + std::to_string(i) + "'/>";
  EXPECT_THAT(FaultOf(many + "</robot>").value, HasSubstr("2001 links"));
  EXPECT_THAT(FaultOf("<robot name='r'>" + std::string(std::size_t{17} << 20, ' ') + "</robot>").message,
              HasSubstr("16 MiB"));
}

TEST(UrdfCheck, ALongChainIsRead) {
  std::string xml = "<robot name='r'><link name='0'/>";
  constexpr int kLinks = 2000;
  for (int i = 1; i < kLinks; ++i) {
    const std::string name = std::to_string(i);
    xml += "<link name='" + name + "'/><joint name='" + name + "' type='fixed'><parent link='" + std::to_string(i - 1) +
           "'/><child link='" + name + "'/></joint>";
  }
  EXPECT_EQ(RobotModel::FromUrdfText(xml + "</robot>", "chain.urdf", ".", CallIsolated).links().size(), 2000U);
}

TEST(UrdfCheck, OtherProgramsElementsAreLetBy) {
  const RobotModel robot = RobotModel::FromUrdfText(
      "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'><gazebo><plugin/></gazebo><transmission name='t'/>"
      "<link name='a' type='laser'><sensor name='s'/><collision group='x'><geometry><sphere radius='1'/></geometry>"
      "<contact_coefficients mu='1'/></collision></link><!-- xacro:nothing --></robot>",
      "robot.urdf", ".", CallIsolated);
  EXPECT_EQ(robot.links()[0].collision.size(), 1U);
}

TEST(UrdfCheck, NamesMayHoldWhatXmlEscapes) {
  const RobotModel robot = RobotModel::FromUrdfText(
      "<robot name='a&amp;b'><link name='&lt;&quot;%s%n&apos;&gt;'/><link name='b&#x20;c'/><joint name='%n' "
      "type='fixed'>"
      "<parent link='&lt;&quot;%s%n&apos;&gt;'/><child link='b c'/></joint></robot>",
      "robot.urdf", ".", CallIsolated);
  EXPECT_EQ(robot.name(), "a&b");
  EXPECT_EQ(robot.links()[0].name, "<\"%s%n'>");
  EXPECT_EQ(robot.links()[1].name, "b c");
  EXPECT_EQ(robot.joints()[0].name, "%n");
}

TEST(UrdfCheck, WhiteSpaceInNumbersIsFree) {
  const RobotModel robot = RobotModel::FromUrdfText(
      "<robot name='r'><link name='a'><inertial><origin xyz=' 1\t2\n 3 '/><mass value=' 14.2 '/>"
      "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='+1.e0'/></inertial></link></robot>",
      "robot.urdf", ".", CallIsolated);
  EXPECT_EQ(robot.total_mass(), 14.2);
  EXPECT_EQ(robot.links()[0].com, Eigen::Vector3d(1, 2, 3));
}

TEST(UrdfCheck, OneNumberScalesAMeshAlongAllAxes) {
  const CheckedUrdf urdf = CheckUrdf(
      "<robot name='r'><link name='a'><collision><geometry><mesh filename='a.stl' scale=' 0.001 '/></geometry>"
      "</collision></link></robot>",
      "robot.urdf");
  EXPECT_THAT(urdf.text, HasSubstr("scale=\"0.001 0.001 0.001\""));
  ASSERT_EQ(urdf.notes.size(), 1U);
  EXPECT_EQ(urdf.notes[0].severity, UrdfSeverity::kWarning);
  EXPECT_THAT(urdf.notes[0].message, HasSubstr("all three axes"));
}

TEST(UrdfCheck, FixedJointsMayHaveNoDirection) {
  const std::string joint =
      "'><parent link='a'/><child link='b'/><axis xyz='0 0 0'/><limit lower='0' upper='1' effort='0' "
      "velocity='0'/></joint>";
  const std::string head = "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='";
  EXPECT_EQ(FaultOf(head + "fixed" + joint + "</robot>").message, "");
  EXPECT_THAT(FaultOf(head + "revolute" + joint + "</robot>").message, HasSubstr("direction"));
}

// The guard is for the meshes: the description itself is read in this process.
TEST(UrdfCheck, TheGuardIsStoredForTheMeshes) {
  const std::string xml = "<robot name='r'><link name='a'/></robot>";
  EXPECT_FALSE(RobotModel::FromUrdfText(xml, "robot.urdf", ".").read_guard());
  int calls = 0;
  const ReadGuard counting = [&calls](const std::function<std::string()>& read, const ReadLimits&) {
    ++calls;
    return read();
  };
  const RobotModel robot = RobotModel::FromUrdfText(xml, "robot.urdf", ".", counting);
  ASSERT_TRUE(robot.read_guard());
  EXPECT_EQ(calls, 0);
  EXPECT_EQ(robot.read_guard()([] { return std::string("answer"); }, {}), "answer");
  EXPECT_EQ(calls, 1);
}

// Compares the model with urdfdom's result for the file itself.
void ExpectReadAsByUrdfdom(const std::string& path) {
  const urdf::ModelInterfaceSharedPtr expected = urdf::parseURDF(ReadUrdfFile(path));
  const RobotModel robot = RobotModel::FromUrdfFile(path, CallIsolated);
  ASSERT_NE(expected, nullptr);
  ASSERT_EQ(robot.links().size(), expected->links_.size());
  ASSERT_EQ(robot.joints().size(), expected->joints_.size());
  const auto translation = [](const urdf::Pose& pose) {
    return Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z);
  };
  // The same formula, compiled here: the last bit depends on how the compiler vectorizes it.
  constexpr double kLastBit = std::numeric_limits<double>::epsilon();
  const auto turned = [](const Eigen::Isometry3d& actual, const urdf::Pose& pose) -> double {
    const Eigen::Quaterniond rotation(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z);
    return (actual.linear() - rotation.normalized().toRotationMatrix()).cwiseAbs().maxCoeff();
  };
  for (const Link& link : robot.links()) {
    const urdf::LinkConstSharedPtr source = expected->getLink(link.name);
    ASSERT_NE(source, nullptr) << link.name;
    EXPECT_EQ(link.mass, source->inertial == nullptr ? 0.0 : source->inertial->mass) << link.name;
    const Eigen::Vector3d com =
        source->inertial == nullptr ? Eigen::Vector3d(0, 0, 0) : translation(source->inertial->origin);
    EXPECT_EQ(link.com, com) << link.name;
    ASSERT_EQ(link.collision.size(), source->collision_array.size()) << link.name;
    for (std::size_t k = 0; k < link.collision.size(); ++k) {
      EXPECT_EQ(link.collision[k].pose.translation(), translation(source->collision_array[k]->origin)) << link.name;
      EXPECT_LE(turned(link.collision[k].pose, source->collision_array[k]->origin), kLastBit) << link.name;
    }
  }
  for (const Joint& joint : robot.joints()) {
    const urdf::JointConstSharedPtr source = expected->getJoint(joint.name);
    ASSERT_NE(source, nullptr) << joint.name;
    EXPECT_EQ(joint.origin.translation(), translation(source->parent_to_joint_origin_transform)) << joint.name;
    EXPECT_LE(turned(joint.origin, source->parent_to_joint_origin_transform), kLastBit) << joint.name;
    if (joint.type != JointType::kRevolute && joint.type != JointType::kPrismatic) continue;
    EXPECT_EQ(joint.lower, source->limits->lower) << joint.name;
    EXPECT_EQ(joint.upper, source->limits->upper) << joint.name;
    EXPECT_EQ(joint.axis, Eigen::Vector3d(source->axis.x, source->axis.y, source->axis.z).normalized()) << joint.name;
  }
}

class SoundRobot : public testing::TestWithParam<std::string> {};

TEST_P(SoundRobot, IsReadAsByUrdfdom) {
  if (!std::filesystem::exists(GetParam())) GTEST_SKIP() << GetParam() << " is not there";
  ExpectReadAsByUrdfdom(GetParam());
}

INSTANTIATE_TEST_SUITE_P(Urdf, SoundRobot,
                         testing::Values(SourceFolder() + "/data/garage-small/robot.urdf",
                                         SourceFolder() + "/data/garage-easier/robot.urdf",
                                         SourceFolder() + "/data/biped/robot.urdf",
                                         TestDataFolder() + "/atlas/atlas.urdf"));

}  // namespace
}  // namespace legopt
