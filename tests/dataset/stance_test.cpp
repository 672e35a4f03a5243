#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <string>

#include "legopt/dataset/problem_definition.h"
#include "legopt/types/task.h"
#include "tests/dataset/test_data.h"

namespace legopt {
namespace {

using test::MessageOf;
using ::testing::AllOf;
using ::testing::HasSubstr;

const TextSource kSource{.file = "p.json", .field = "problem 3, stance 1"};

TEST(Stance, QuaternionIsWxyzAndTrailingCommaIsDropped) {
  const Stance stance = ParseStance("l_foot,0.6 0 0 0.8 1 2 3 ,r_foot,1 0 0 0 -4 5e-1 +6 ,", kSource);
  ASSERT_EQ(stance.contacts.size(), 2u);
  EXPECT_EQ(stance.contacts[0].contact, "l_foot");
  EXPECT_EQ(stance.contacts[0].rotation.w(), 0.6);
  EXPECT_EQ(stance.contacts[0].rotation.z(), 0.8);
  EXPECT_EQ(stance.contacts[0].position, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(stance.contacts[1].position, Eigen::Vector3d(-4, 0.5, 6));
}

TEST(Stance, OneFootWithAndWithoutSpacesAndComma) {
  for (const char* text : {"l_foot,1 0 0 0 1 2 3", "l_foot,1 0 0 0 1 2 3,", " l_foot ,  1 0  0 0 1 2 3  , "}) {
    const Stance stance = ParseStance(text, kSource);
    ASSERT_EQ(stance.contacts.size(), 1u) << text;
    EXPECT_EQ(stance.contacts[0].contact, "l_foot");
  }
}

TEST(Stance, FaultsNamePlaceAndReason) {
  const auto message = [](const char* text) { return MessageOf([&] { ParseStance(text, kSource); }); };
  EXPECT_THAT(message("l_foot,1 0 0 0 1 2 ,"), AllOf(HasSubstr("p.json: problem 3, stance 1"), HasSubstr("6 numbers")));
  EXPECT_THAT(message("l_foot,1 0 0 0 1 2 3 4,"), HasSubstr("8 numbers"));
  EXPECT_THAT(message(""), HasSubstr("no contacts"));
  EXPECT_THAT(message(" , "), HasSubstr("alternate"));
  EXPECT_THAT(message("l_foot,"), HasSubstr("alternate"));
  EXPECT_THAT(message("l_foot,1 0 0 0 1 2 x,"), AllOf(HasSubstr("not a number"), HasSubstr("'x'")));
  EXPECT_THAT(message("l_foot,1 0 0 0 1 2 3.0m,"), HasSubstr("not a number"));
  EXPECT_THAT(message("l_foot,1 0 0 0 nan 2 3,"), HasSubstr("finite"));
  EXPECT_THAT(message("l_foot,1 0 0 0 1 2 inf,"), HasSubstr("finite"));
  EXPECT_THAT(message("l_foot,1 0 0 0.01 1 2 3,"), HasSubstr("not unit"));
  EXPECT_THAT(message("l_foot,0 0 0 0 1 2 3,"), HasSubstr("not unit"));
  EXPECT_THAT(message("l_foot,0.75 0 0 0 1 2 3,"), AllOf(HasSubstr("its norm is 0.75,"), HasSubstr("more than 1e-06")));
  EXPECT_THAT(message("l_foot,1 0 0 0 1 2 3,l_foot,1 0 0 0 1 2 3,"), HasSubstr("twice"));
}

TEST(Stance, FormattingRoundTripsEveryBit) {
  std::mt19937_64 generator(7);
  const auto number = [&] { return std::ldexp(static_cast<double>(generator() >> 11), -53) * 40 - 20; };
  for (int i = 0; i < 200; ++i) {
    Stance stance;
    for (const char* link : {"l_foot", "r_foot"}) {
      const Eigen::Quaterniond q = Eigen::Quaterniond(number(), number(), number(), number()).normalized();
      stance.contacts.push_back({.contact = link, .position = {number(), number(), number()}, .rotation = q});
    }
    EXPECT_TRUE(ParseStance(FormatStance(stance), kSource) == stance) << FormatStance(stance);
  }
}

Stance ReadObject(const std::string& text) { return ReadStance(nlohmann::json::parse(text), kSource); }

constexpr const char* kTwoContacts = "\"contacts\": \"foot,1 0 0 0 1 2 3 ,palm,1 0 0 0 -4 5 6 ,\"";

TEST(Stance, AnObjectSaysMoreThanPoses) {
  const Stance plain = ReadObject(std::string("{") + kTwoContacts + "}");
  EXPECT_TRUE(plain == ParseStance("foot,1 0 0 0 1 2 3,palm,1 0 0 0 -4 5 6", kSource));
  EXPECT_TRUE(StanceJson(plain).is_string()) << "LegOpt's form, where it suffices";
  const Stance stance =
      ReadObject(std::string("{") + kTwoContacts +
                 R"(, "friction": {"palm": 0.3}, "load": {"foot": "touch", "palm": "carry"}, "slide_m": {"palm": 0.2},
                    "push_N": 45})");
  EXPECT_EQ(stance.contacts[1].friction, 0.3);
  EXPECT_FALSE(stance.contacts[0].friction);
  EXPECT_FALSE(stance.contacts[0].carries);
  EXPECT_TRUE(stance.contacts[1].carries);
  EXPECT_EQ(stance.contacts[1].slide_m, 0.2);
  EXPECT_EQ(stance.push_N, 45.0);
  EXPECT_FALSE(stance == plain);
  EXPECT_NE(StanceKey(stance), StanceKey(plain));
  EXPECT_TRUE(ReadStance(StanceJson(stance), kSource) == stance) << StanceJson(stance);
}

TEST(Stance, FaultsOfObjectsNameTheKey) {
  const auto message = [](const std::string& more) {
    return MessageOf([&] { ReadObject(std::string("{") + kTwoContacts + more + "}"); });
  };
  EXPECT_THAT(message(R"(, "friction": {"palm": -0.3})"),
              AllOf(HasSubstr("problem 3, stance 1, friction.palm: must lie in (0, 2]"), HasSubstr("-0.3")));
  EXPECT_THAT(message(R"(, "friction": {"plam": 0.3})"),
              AllOf(HasSubstr("the stance has no such contact"), HasSubstr("did you mean 'palm'?")));
  EXPECT_THAT(message(R"(, "friction": {"palm": "high"})"), HasSubstr("friction.palm: must be a finite number"));
  EXPECT_THAT(message(R"(, "friction": 0.3)"), HasSubstr("friction: must map contacts to values"));
  EXPECT_THAT(message(R"(, "load": {"palm": "none"})"), AllOf(HasSubstr("load.palm"), HasSubstr("touch")));
  EXPECT_THAT(message(R"(, "slide_m": {"palm": -1})"), HasSubstr("slide_m.palm: must lie in [0, 1]"));
  EXPECT_THAT(message(R"(, "load": {"palm": "touch", "foot": "touch"})"),
              HasSubstr("problem 3, stance 1, load: no contact carries the robot"));
  EXPECT_THAT(message(R"(, "push_N": 0)"), HasSubstr("push_N: must be greater than 0"));
  EXPECT_THAT(message(R"(, "push": 3)"), AllOf(HasSubstr("push: unknown key"), HasSubstr("did you mean 'push_N'?")));
  EXPECT_THAT(MessageOf([] { ReadObject("{}"); }), HasSubstr("or an object with the text 'contacts'"));
  EXPECT_THAT(MessageOf([] { ReadObject("3"); }), HasSubstr("must be a text"));
}

TEST(Stance, WaypointsPerProblem) {
  EXPECT_EQ(NumWaypoints(Task::kPosture, 1), 1);
  EXPECT_EQ(StanceOfWaypoint(Task::kPosture, 0), 0);
  EXPECT_EQ(NumWaypoints(Task::kMotion, 3), 6);
  EXPECT_EQ(StanceOfWaypoint(Task::kMotion, 3), 1);
}

TEST(Stance, ATaskSaysHowManyAProblemHas) {
  ProblemDefinition problem{.id = 0, .stances = {}};
  for (const auto& [stances, posture, motion] : {std::tuple(0, false, false), std::tuple(1, true, false),
                                                 std::tuple(2, false, true), std::tuple(500, false, true)}) {
    problem.stances.resize(static_cast<size_t>(stances));
    EXPECT_EQ(Fits(Task::kPosture, problem), posture) << stances;
    EXPECT_EQ(Fits(Task::kMotion, problem), motion) << stances;
  }
  EXPECT_EQ(DescribeStanceCounts(), "a posture problem has one stance, a motion problem two or more");
}

// A foot is planted in the segment between two stances if it has bitwise the same target in both.
TEST(Words, TasksAndInitialisations) {
  EXPECT_EQ(ReadTask(ToString(Task::kMotion), "f"), Task::kMotion);
  EXPECT_EQ(ReadInitialization(ToString(Initialization::kInCollision), "f"), Initialization::kInCollision);
  EXPECT_EQ(ReadInitialization("in-collision", "f"), Initialization::kInCollision);
  EXPECT_EQ(MessageOf([] { ReadTask("walk", "f.yaml"); }),
            "f.yaml: task: unknown task (got 'walk'); use 'posture', 'motion', 'continuous', 'balanced' or 'timed'");
  EXPECT_EQ(MessageOf([] { ReadInitialization("bad", "f.yaml"); }),
            "f.yaml: initialization: unknown initialisation (got 'bad'); use 'good' or 'in_collision'");
}

}  // namespace
}  // namespace legopt
