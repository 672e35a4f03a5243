// Policy: a mistake in the contacts of a dataset is an error of `legopt dataset check` and of `legopt run`, with exit
// code 2, that names file, field, value and fix.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <regex>

#include "command_line_fixture.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A change of one file of data/hands-small, and the error that follows.
struct Mistake {
  std::string name;
  std::string file;
  std::string from, to;
  std::string field, value, fix;
};

class BadContacts : public CommandLine, public testing::WithParamInterface<Mistake> {
 protected:
  BadContacts() {
    std::filesystem::copy(std::filesystem::path(SourceFolder()) / "data" / "hands-small", dataset_,
                          std::filesystem::copy_options::recursive);
  }
  ProgramResult Check() { return Run({"dataset", "check", dataset_.string()}); }
  ProgramResult Solve() { return Run({"run", (dataset_ / "suite.yaml").string(), "--db", "hands.sqlite"}); }
  void Replace(const std::string& file, const std::string& from, const std::string& to) {
    test::ReplaceInFile(dataset_ / file, from, to);
  }

  std::filesystem::path dataset_ = folder_.path() / "hands";
};

TEST_P(BadContacts, AreNamedWithFileFieldValueAndFix) {
  const Mistake& mistake = GetParam();
  Replace(mistake.file, mistake.from, mistake.to);
  Run({"dataset", "hash", dataset_.string()});  // refuses most of them as well
  for (const ProgramResult& result : {Check(), Solve()}) {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, AllOf(HasSubstr((dataset_ / mistake.file).string() + ": " + mistake.field),
                                  HasSubstr("(got '" + mistake.value + "')"), HasSubstr("; " + mistake.fix)));
  }
}

constexpr const char* kPalm =
    "[[0.04, 0.025, 0.001], [-0.04, 0.025, 0.001], [-0.04, -0.025, 0.001], [0.04, -0.025, 0.001]]";

INSTANTIATE_TEST_SUITE_P(
    OneByOne, BadContacts,
    testing::Values(
        Mistake{"UnknownKind", "dataset.yaml", "kind: palm", "kind: plam",
                "contacts.l_palm.kind: is no kind of contact", "plam", "did you mean 'palm'?"},
        Mistake{"NegativeFriction", "dataset.yaml", "friction: 0.5", "friction: -0.5",
                "contacts.l_foot.friction: must lie in (0, 2]", "-0.5", "typical values: 0.4 to 0.8"},
        Mistake{"NegativeFrictionOfAStance", "problems-posture.json", "\"push_N\": 40",
                "\"friction\": {\"l_palm\": -0.3}", "problem 2, stance 0, friction.l_palm: must lie in (0, 2]", "-0.3",
                "typical values: 0.4 to 0.8"},
        Mistake{"MissingLink", "dataset.yaml", "link: l_hand", "link: l_hnd",
                "contacts.l_palm.link: the robot has no such link", "l_hnd", "did you mean 'l_hand'?"},
        Mistake{"StanceWithoutContacts", "problems-posture.json", "{\"id\": 0, \"definition\": [\"",
                "{\"id\": 9, \"definition\": [\"\"]}, {\"id\": 0, \"definition\": [\"",
                "problem 9, stance 0: the stance has no contacts", "\"\"", "write 'contact,qw qx qy qz px py pz,'"},
        Mistake{"ProblemWithoutStances", "problems-posture.json", "{\"id\": 0, \"definition\": [\"",
                "{\"id\": 9, \"definition\": []}, {\"id\": 0, \"definition\": [\"",
                "problem 9, definition: must be a list of at least one stance", "[]", "write [\"contact,qw qx"},
        Mistake{"EffortZero", "dataset.yaml", "gravity_m_s2", "effort_limits: {l_leg_kny: 0}\ngravity_m_s2",
                "effort_limits.l_leg_kny: must be greater than 0", "0", "write the joint's limit"},
        Mistake{"CrossingEdges", "dataset.yaml", kPalm,
                "[[0.04, 0.025, 0.001], [-0.04, -0.025, 0.001], [-0.04, 0.025, 0.001], [0.04, -0.025, 0.001]]",
                "contacts.l_palm.points: the edges from points[0] and points[2] cross",
                "[0.04, 0.025, 0.001] to [-0.04, -0.025, 0.001] and [-0.04, 0.025, 0.001] to [0.04, -0.025, 0.001]",
                "list the corners in their order around the patch"},
        Mistake{"DuplicatePoints", "dataset.yaml", kPalm,
                "[[0.04, 0.025, 0.001], [0.04, 0.025, 0.001], [-0.04, -0.025, 0.001], [0.04, -0.025, 0.001]]",
                "contacts.l_palm.points[1]: is the same point as points[0]", "[0.04, 0.025, 0.001]",
                "remove one of them"}),
    [](const auto& mistake) { return mistake.param.name; });

using UnboundedPolygon = BadContacts;

/// Hands between opposite walls, without a bound of their forces.
constexpr const char* kOpposite = "0.7071067811865476 0.0 0.7071067811865475 0.0 -0.55 -0.25 1.1";
constexpr const char* kSameWall = "0.7071067811865476 0.0 -0.7071067811865475 0.0 0.55 -0.25 1.1";

TEST_F(UnboundedPolygon, IsAWarningWhereEffortsBoundTheForces) {
  Replace("problems-posture.json", kSameWall, kOpposite);
  ASSERT_EQ(Run({"dataset", "hash", dataset_.string()}).exit_code, 0);
  const ProgramResult result = Check();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("warn  balance"), HasSubstr("posture 0"),
                                HasSubstr("1 of 3 stances, first posture 0, stance 0"),
                                HasSubstr("hold the centre of mass anywhere"), HasSubstr("max_normal_N")));
  EXPECT_EQ(Solve().exit_code, 0);
}

TEST_F(UnboundedPolygon, IsAnErrorWhereNothingBoundsTheForces) {
  Replace("problems-posture.json", kSameWall, kOpposite);
  const std::string robot = test::ReadText(dataset_ / "robot.urdf");
  test::WriteText(dataset_ / "robot.urdf", std::regex_replace(robot, std::regex("effort=\"[0-9.]+\""), "effort=\"0\""));
  ASSERT_EQ(Run({"dataset", "hash", dataset_.string()}).exit_code, 0);
  const ProgramResult check = Check();
  EXPECT_EQ(check.exit_code, 2);
  EXPECT_THAT(check.out, AllOf(HasSubstr("FAIL  balance"), HasSubstr("posture 0")));
  const ProgramResult run = Solve();
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("dataset.yaml: posture 0: hold the centre of mass anywhere"),
                             HasSubstr("so every posture counts as held (got '1 of 3 stances, first posture 0"),
                             HasSubstr("; give these contacts max_normal_N, or their joints effort_limits")));

  test::ReplaceInFile(dataset_ / "dataset.yaml",
                      "    friction: 0.5\n  r_palm:", "    friction: 0.5\n    max_normal_N: 300\n  r_palm:");
  EXPECT_THAT(Check().out, Not(HasSubstr("balance"))) << "one bound suffices";
}

}  // namespace
}  // namespace legopt::client
