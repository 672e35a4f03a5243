// Policy: an imported robot gets a nominal posture with bent legs and stands on level ground and on a slope; a robot
// that cannot stand is not imported, and the constraints in conflict are named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "legopt/dataset/dataset.h"
#include "legopt/import/importer.h"
#include "tests/dataset/test_data.h"
#include "tests/import/import_fixture.h"
#include "tests/import/walker.h"

namespace legopt {
namespace {

namespace fs = std::filesystem;
using Severity = DatasetDiagnostic::Severity;
using testing::AllOf;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

using test::kBall;
using test::kSole;
using test::Link;
using test::Walker;

using Standing = test::RobotImport;

TEST_F(Standing, ABipedGetsBentKneesAndStandsOnLevelAndSlope) {
  const ImportReport report = Import({});
  const auto standing = Of(report, "standing");
  ASSERT_EQ(standing.size(), 2U);
  for (const DatasetDiagnostic& finding : standing) EXPECT_EQ(finding.severity, Severity::kInfo) << finding.value;
  const auto dataset = Dataset::Load(out_);
  const RobotModel& robot = dataset->robot();
  for (const std::string knee : {"l_knee", "r_knee"}) {
    const int dof = robot.joints()[static_cast<std::size_t>(robot.FindJoint(knee))].dof;
    // A leg of two equal links that is shortened by 12 % has a knee of 2 acos(0.88) = 0.99 rad.
    EXPECT_NEAR(dataset->nominal_joints()[dof], 0.99, 0.25);
  }
  EXPECT_FALSE(fs::exists(out_ / ".standing"));
}

TEST_F(Standing, AQuadrupedOnBallsStands) {
  Walker walker{.legs = {{"lf", "0.2 0.1"}, {"rf", "0.2 -0.1"}, {"lh", "-0.2 0.1"}, {"rh", "-0.2 -0.1"}},
                .foot = kBall};
  const ImportReport report = Import(walker);
  const auto standing = Of(report, "standing");
  ASSERT_EQ(standing.size(), 2U);
  for (const DatasetDiagnostic& finding : standing) EXPECT_EQ(finding.severity, Severity::kInfo) << finding.value;
  const auto dataset = Dataset::Load(out_);
  ASSERT_EQ(dataset->contacts().size(), 4U);
  for (const Contact& contact : dataset->contacts()) EXPECT_EQ(contact.kind, ContactKind::kPoint);
}

/// A plate on four balls at its corners, whose lowest points are 15 mm below it.
std::string FootOnBalls(double length_m, double width_m) {
  std::string foot = "<origin xyz='0.025 0 -0.01'/><geometry><box size='" + std::to_string(length_m) + " " +
                     std::to_string(width_m) + " 0.04'/></geometry>";
  for (const double x_m : {0.025 - 0.5 * length_m, 0.025 + 0.5 * length_m}) {
    for (const double y_m : {-0.5 * width_m, 0.5 * width_m}) {
      foot += "</collision><collision><origin xyz='" + std::to_string(x_m) + " " + std::to_string(y_m) +
              " -0.04'/><geometry><sphere radius='0.005'/></geometry>";
    }
  }
  return foot;
}

TEST_F(Standing, FeetOnFourBallsAreSoles) {
  for (const auto& [length_m, width_m] : {std::pair(0.15, 0.06), std::pair(0.06, 0.04)}) {
    const ImportReport report = Import({.foot = FootOnBalls(length_m, width_m)});
    for (const DatasetDiagnostic& finding : Of(report, "standing")) {
      EXPECT_EQ(finding.severity, Severity::kInfo) << finding.value;
    }
    const auto dataset = Dataset::Load(out_);
    for (const Contact& contact : dataset->contacts()) {
      EXPECT_EQ(contact.kind, ContactKind::kSole);
      EXPECT_NEAR(contact.Patch().sizes().x(), length_m, 1e-5);
      EXPECT_NEAR(contact.Patch().sizes().y(), width_m, 1e-5);
    }
    fs::remove_all(out_);
  }
}

TEST_F(Standing, MeshesInMillimetresNeedAScaleAndOpenOnesGetAWarning) {
  const Walker walker{.foot = "<geometry><mesh filename='foot.stl'/></geometry>"};
  std::string text = "solid foot\n";
  const auto corner = [](int i) {
    return "vertex " + std::to_string(i % 2 == 0 ? -70 : 130) + " " + std::to_string(i / 2 % 2 == 0 ? -50 : 50) + " " +
           std::to_string(i / 4 == 0 ? -50 : -10) + "\n";
  };
  for (const auto& [a, b, c] : std::vector<std::array<int, 3>>{{0, 2, 1},
                                                               {1, 2, 3},
                                                               {4, 5, 6},
                                                               {5, 7, 6},
                                                               {0, 1, 4},
                                                               {1, 5, 4},
                                                               {2, 6, 3},
                                                               {3, 6, 7},
                                                               {0, 4, 2},
                                                               {2, 4, 6},
                                                               {1, 3, 5},
                                                               {3, 7, 5}}) {
    text += "facet normal 0 0 0\nouter loop\n" + corner(a) + corner(b) + corner(c) + "endloop\nendfacet\n";
  }
  test::WriteText(folder_.path() / "in" / "foot.stl", text + "endsolid\n");
  EXPECT_THAT(test::MessageOf([&] { Import(walker); }), AllOf(HasSubstr("l_foot"), HasSubstr("--mesh-scale 0.001")));
  fs::remove_all(out_);
  options_.mesh_scale = 0.001;
  ImportReport report = Import(walker);
  EXPECT_FALSE(AnyError(report.findings));
  EXPECT_NEAR(Dataset::Load(out_)->contacts()[0].Patch().sizes().x(), 0.2, 1e-6);
  EXPECT_TRUE(Of(report, "link meshes").empty());

  const std::size_t last = text.rfind("facet normal");
  test::WriteText(folder_.path() / "in" / "foot.stl", text.substr(0, last) + "endsolid\n");
  fs::remove_all(out_);
  report = Import(walker);
  ASSERT_FALSE(Of(report, "link meshes").empty()) << "the mesh has a hole";
  EXPECT_THAT(Of(report, "link meshes").back().message, HasSubstr("not closed"));
}

TEST_F(Standing, ARobotThatFallsSidewaysNamesTheConflict) {
  Walker walker{.trunk_com_y_m = 2.0};
  const ImportReport report = Import(walker);
  const auto standing = Of(report, "standing");
  ASSERT_FALSE(standing.empty());
  EXPECT_EQ(standing.front().severity, Severity::kError);
  EXPECT_THAT(standing.front().value, HasSubstr("centre of mass"));
  EXPECT_THAT(standing.front().fix, HasSubstr("--no-proof"));
  EXPECT_TRUE(AnyError(report.findings));
}

TEST_F(Standing, AnSrdfStateIsTheReference) {
  std::string joints;
  for (const std::string side : {"l", "r"}) {
    joints += "<joint name='" + side + "_pitch' value='-0.6'/><joint name='" + side + "_knee' value='1.2'/>" +
              "<joint name='" + side + "_ankle' value='-0.6'/>";
  }
  test::WriteText(folder_.path() / "in" / "srdf" / "robot.srdf",
                  "<robot name='walker'><group_state name='sitting' group='all'/><group_state name='Half-Sitting 2' "
                  "group='all'>" +
                      joints + "</group_state></robot>");
  const ImportReport report = Import({});
  const auto srdf = Of(report, "SRDF");
  ASSERT_EQ(srdf.size(), 1U);
  EXPECT_EQ(srdf.front().value, "Half-Sitting 2");
  const auto dataset = Dataset::Load(out_);
  const RobotModel& robot = dataset->robot();
  const int knee = robot.joints()[static_cast<std::size_t>(robot.FindJoint("l_knee"))].dof;
  EXPECT_NEAR(dataset->nominal_joints()[knee], 1.2, 0.1);
}

// A ball is in the trunk unless its leg is rolled outwards; on level soles, both legs cannot be.
TEST_F(Standing, ShellsThatOverlapWhereverTheRobotStandsAreNotCompared) {
  const ImportReport report = Import({.thigh_ball_m = 0.11});
  for (const DatasetDiagnostic& finding : Of(report, "standing")) {
    EXPECT_EQ(finding.severity, Severity::kInfo) << finding.value;
  }
  const auto dataset = Dataset::Load(out_);
  ASSERT_TRUE(dataset->unchecked_pairs().has_value());
  std::vector<LinkPair> pairs;
  for (const UncheckedPair& entry : *dataset->unchecked_pairs()) {
    if (entry.reason == UncheckedReason::kStanding) pairs.push_back(entry.pair);
  }
  const RobotModel& robot = dataset->robot();
  const int trunk = robot.FindLink("trunk");
  EXPECT_THAT(pairs, UnorderedElementsAre(LinkPair{trunk, robot.FindLink("l_thigh")},
                                          LinkPair{trunk, robot.FindLink("r_thigh")}));
  const auto pair_findings = Of(report, "link pairs");
  EXPECT_TRUE(std::ranges::any_of(pair_findings, [](const DatasetDiagnostic& finding) {
    return finding.severity == Severity::kWarning && finding.value == "2 pairs";
  }));
}

TEST_F(Standing, ContactsAreAlsoNamedByTheirNumbers) {
  options_.contacts = {"2", "l_foot"};
  Import({});
  EXPECT_EQ(Dataset::Load(out_)->contacts()[0].link, "r_foot");
  fs::remove_all(out_);
  options_.contacts = {"9"};
  EXPECT_THAT(test::MessageOf([&] { Import({}); }), AllOf(HasSubstr("--contacts"), HasSubstr("1 l_foot, 2 r_foot")));
}

// With all joints at 0, the left feet are 17 % of the height above the right ones.
TEST_F(Standing, FeetOnBothSidesAreFoundAlthoughOneSideIsHigher) {
  Walker walker{.legs = {{"lf", "0.2 0.1"}, {"rf", "0.2 -0.1"}, {"lh", "-0.2 0.1"}, {"rh", "-0.2 -0.1"}},
                .foot = kBall};
  std::string text = walker.Urdf();
  for (const std::string place : {"'0.2 0.1 0'", "'-0.2 0.1 0'"}) {
    text.replace(text.find(place), place.size(), place.substr(0, place.size() - 2) + "0.15'");
  }
  options_.prove = false;
  ImportText(text);
  EXPECT_EQ(Dataset::Load(out_)->contacts().size(), 4U);
}

// With all joints at 0, and in the middle of their limits, the legs are stretched forwards, and the trunk is as low.
TEST_F(Standing, ARobotThatLiesShowsNoFeet) {
  std::string text = Walker().Urdf();
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  };
  replace("'0 0 -0.3'", "'0.3 0 0'");
  replace("lower='0' upper='2.5'", "lower='-2.5' upper='2.5'");
  replace("<origin xyz='0 0 0.2'/>", "<origin xyz='0 0 0.05'/>");
  EXPECT_THAT(test::MessageOf([&] { ImportText(text); }),
              AllOf(HasSubstr("--contacts"), HasSubstr("1 l_foot, 2 r_foot")));
}

TEST_F(Standing, FeetWithVisualGeometryOnlyAreMeasuredOnIt) {
  Walker walker{.foot = ""};
  std::string text = walker.Urdf();
  for (const std::string side : {"l", "r"}) {
    const std::string begin = "<link name='" + side + "_foot'>";
    text.insert(text.find(begin) + begin.size(), "<visual>" + std::string(kSole) + "</visual>");
  }
  const ImportReport report = ImportText(text);
  EXPECT_EQ(Dataset::Load(out_)->contacts()[0].kind, ContactKind::kSole);
  const auto robot = Of(report, "robot");
  EXPECT_TRUE(
      std::ranges::any_of(robot, [](const DatasetDiagnostic& finding) { return finding.field == "l_foot, r_foot"; }));
}

TEST_F(Standing, AFootOnForceSensorsIsNamedByItsFirstLink) {
  std::string sensors;
  int number = 0;
  for (const char* corner : {"0.12 0.04", "0.12 -0.04", "-0.06 0.04", "-0.06 -0.04"}) {
    for (const std::string side : {"l", "r"}) {
      const std::string name = side + "_sensor" + std::to_string(number);
      sensors += Link(name, 0.01, 0.0, "<geometry><box size='0.03 0.03 0.01'/></geometry>") + "<joint name='" + name +
                 "_joint' type='fixed'><parent link='" + side + "_foot'/><child link='" + name + "'/><origin xyz='" +
                 corner + " -0.053'/></joint>";
    }
    ++number;
  }
  Import({.more = sensors});
  EXPECT_EQ(Dataset::Load(out_)->contacts()[0].link, "l_foot");
}

TEST_F(Standing, TheViewShowsSolesAndCentreOfMass) {
  const ImportReport report = Import({});
  ASSERT_TRUE(report.standing.has_value());
  const StandingView& view = report.standing->view;
  EXPECT_EQ(view.links.size(), 3U);
  ASSERT_EQ(view.contacts.size(), 2U);
  for (const auto& contact : view.contacts) {
    ASSERT_EQ(contact.size(), 4U);
    for (const Eigen::Vector3d& corner : contact) EXPECT_NEAR(corner.z(), 0.0, 3e-3);
  }
  EXPECT_GT(view.com.z(), 0.2);
}

TEST_F(Standing, TheProofCanBeLeftOut) {
  options_.prove = false;
  const ImportReport report = Import({.trunk_com_y_m = 2.0});
  EXPECT_TRUE(Of(report, "standing").empty());
  EXPECT_FALSE(AnyError(report.findings));
}

}  // namespace
}  // namespace legopt
