// Policy: feet are described as they touch: balls as points, edges as their middle, soles as patches whatever marks
// them; where this is doubtful, nothing is guessed. SRDFs say which pairs do not count.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "legopt/dataset/dataset.h"
#include "tests/import/import_fixture.h"

namespace legopt {
namespace {

using Severity = DatasetDiagnostic::Severity;
using test::kBall;
using test::kSole;
using test::Walker;
using testing::AllOf;
using testing::HasSubstr;
using Feet = test::RobotImport;

const std::vector<std::pair<std::string, std::string>> kFourLegs = {
    {"lf", "0.2 0.1"}, {"rf", "0.2 -0.1"}, {"lh", "-0.2 0.1"}, {"rh", "-0.2 -0.1"}};

void ExpectStands(const std::vector<DatasetDiagnostic>& standing) {
  ASSERT_EQ(standing.size(), 2U);
  for (const DatasetDiagnostic& finding : standing) {
    EXPECT_EQ(finding.severity, Severity::kInfo) << finding.value << finding.message;
  }
}

TEST_F(Feet, ACylinderThatLiesTouchesWithTheMiddleOfItsLowestEdge) {
  const ImportReport report =
      Import({.legs = kFourLegs,
              .foot = "<origin xyz='0 0 -0.03' rpy='1.5707963 0 0'/><geometry><cylinder radius='0.03' "
                      "length='0.04'/></geometry>"});
  ExpectStands(Of(report, "standing"));
  for (const Contact& contact : Imported().contacts()) {
    EXPECT_EQ(contact.kind, ContactKind::kPoint);
    EXPECT_EQ(contact.radius_m, 0.0) << "its rims lie on a ball, its faces do not";
    EXPECT_NEAR(contact.X_LC.translation().y(), 0.0, 1e-6);
  }
}

TEST_F(Feet, ASmallBoxIsNoBall) {
  const ImportReport report =
      Import({.legs = kFourLegs, .foot = "<origin xyz='0 0 -0.01'/><geometry><box size='0.02 0.02 0.02'/></geometry>"});
  ExpectStands(Of(report, "standing"));
  for (const Contact& contact : Imported().contacts()) EXPECT_EQ(contact.radius_m, 0.0);
}

TEST_F(Feet, AMarkerDoesNotMakeASoleAPoint) {
  const std::string marked =
      std::string(kSole) +
      "</collision><collision><origin xyz='0.03 0 -0.05'/><geometry><sphere radius='0'/></geometry>";
  ExpectStands(Of(Import({.foot = marked}), "standing"));
  for (const Contact& contact : Imported().contacts()) EXPECT_EQ(contact.kind, ContactKind::kSole);
}

TEST_F(Feet, LargeFeetStandFurtherApart) {
  std::string soles;
  for (const std::string side : {"l", "r"}) {
    soles +=
        test::Link(side + "_sole", 0.5, 0.0,
                   "<origin xyz='0 0 -0.03'/><geometry><box size='0.2 0.3 0.04'/></geometry>") +
        test::Joint(side + "_ankle_roll", side + "_foot", side + "_sole", "0 0 0", "1 0 0", "lower='-0.6' upper='0.6'");
  }
  ExpectStands(Of(Import({.foot = "", .more = soles}), "standing"));
}

TEST_F(Feet, TwoSolesMayBeSteepInTheZeroPosture) {
  const std::string steep =
      "<origin xyz='0.03 0 -0.03' rpy='0 0.785398 0'/><geometry><box size='0.2 0.1 0.04'/></geometry>";
  ExpectStands(Of(Import({.foot = steep, .ankle_limits = "lower='-1.4' upper='0.4'"}), "standing"));
  for (const Contact& contact : Imported().contacts()) EXPECT_EQ(contact.kind, ContactKind::kSole);
}

TEST_F(Feet, LinksWithBlanksAndCommasGiveContactsWithout) {
  const ImportReport report = Import({.legs = {{"left, lower", "0 0.1"}, {"r", "0 -0.1"}}});
  ExpectStands(Of(report, "standing"));
  EXPECT_EQ(Imported().contacts()[0].link, "left, lower_foot");
  EXPECT_EQ(Imported().contacts()[0].name, "left__lower_foot");
}

TEST_F(Feet, AnAbsentMeshOfTheirOnlyGeometryIsTheCause) {
  std::string urdf = Walker{.foot = ""}.Urdf();
  const std::string foot = "<link name='l_foot'>";
  urdf.replace(urdf.find(foot), foot.size(),
               foot + "<visual><geometry><mesh filename='gone.stl'/></geometry></visual>");
  EXPECT_THAT(test::MessageOf([&] { ImportText(urdf); }),
              AllOf(HasSubstr("gone.stl"), HasSubstr("because no end link of the robot has collision geometry")));
}

TEST_F(Feet, HandsThatReachBelowTheSolesAreAskedAbout) {
  std::string arms;
  for (const auto& [name, y] : {std::pair("handl", "0.4"), std::pair("handr", "-0.4")}) {
    arms += test::Link(name, 0.5, 0.0, "<origin xyz='0 0 -0.45'/><geometry><box size='0.02 0.02 0.9'/></geometry>") +
            test::Joint(std::string(name) + "_joint", "trunk", name, std::string("0 ") + y + " 0.1", "0 1 0",
                        "lower='-1' upper='1'");
  }
  EXPECT_THAT(test::MessageOf([&] { Import({.more = arms}); }),
              AllOf(HasSubstr("not clear"), HasSubstr("handl"), HasSubstr("l_foot")));
  options_.contacts = {"l_foot", "r_foot"};
  EXPECT_FALSE(AnyError(Import({.more = arms}).findings)) << "it lifts its hands";
}

TEST_F(Feet, ASoleThatIsNotWhereItIsDescribedDoesNotStand) {
  options_.contacts = {"l_foot", "r_foot"};
  options_.sole_offset_m = 0.15;  // it is 50 mm below the link's frame
  const auto standing = Of(Import({}), "standing");
  ASSERT_EQ(standing.size(), 2U);
  EXPECT_EQ(standing[0].severity, Severity::kError);
  EXPECT_THAT(standing[0].value, HasSubstr("does not fit the robot"));
}

TEST_F(Feet, PairsThatAnSrdfExcludesAreNotCompared) {
  const auto counted = [&](const std::string& more) {
    test::WriteText(folder_.path() / "in" / "robot.srdf", "<robot name='walker'>" + more + "</robot>");
    const ImportReport report = Import({.thigh_ball_m = 0.03});
    int excluded = 0;
    for (const UncheckedPair& pair : *Imported().unchecked_pairs()) {
      excluded += pair.reason == UncheckedReason::kUser ? 1 : 0;
    }
    return std::pair(excluded, Of(report, "SRDF"));
  };
  EXPECT_EQ(counted("").first, 0);
  const std::string pair = "<disable_collisions link1='r_thigh' link2='l_thigh' reason='";
  EXPECT_EQ(counted(pair + "User'/>").first, 1);
  EXPECT_EQ(counted(pair + "Adjacent'/>").first, 0) << "samples decide";
  EXPECT_EQ(counted("<disable_collisions link1='none' link2='l_thigh'/>").first, 0);
  const auto broken = counted("<disable").second;
  ASSERT_EQ(broken.size(), 1U);
  EXPECT_EQ(broken[0].severity, Severity::kWarning);
}

TEST_F(Feet, AllFaultsOfAFileAreReportedAtOnce) {
  Walker walker;
  walker.more = test::Link("cap", -1.0, 0.0, "<geometry><mesh filename='gone.stl'/></geometry>") +
                test::Joint("cap_joint", "trunk", "cap", "0 0 0.4", "0 0 0", "lower='1' upper='-1'") +
                test::Joint("second", "l_foot", "cap", "0 0 0", "0 1 0", "lower='0' upper='1'");
  const std::string text = test::MessageOf([&] { Import(walker); });
  for (const char* part : {"must not be negative", "has no direction", "lower must not exceed upper",
                           "is the child of two joints", "gone.stl", "line "}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text, testing::Not(HasSubstr("line 0")));
}

}  // namespace
}  // namespace legopt
