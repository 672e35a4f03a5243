// Policy: commands on solution files and dataset folders name the error in the file, and continue where possible.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "command_line_fixture.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using FileCommands = CommandLine;

TEST_F(FileCommands, BadSolutionFile) {
  ExpectError(Run({"evaluate", "/nowhere/solutions.json"}), 2, "/nowhere/solutions.json");
  ExpectError(Run({"evaluate", Write("broken.json", "{\"problems\": [")}), 2, "broken.json");
}

// The embedded posture solutions with one number of problem 3 replaced.
TEST_F(FileCommands, EvaluateJudgesTheOthersWhenANumberCannotBeRead) {
  std::ifstream stream(std::filesystem::path(SourceFolder()) / "data/garage-easier/solutions-posture.json");
  auto json = nlohmann::json::parse(stream);
  json["problems"][3]["solution"][0]["x"][0] = "0.1\n1e400";
  const auto result = Run({"evaluate", Write("bad.json", json.dump()), "--format", "json"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("1 of 50 solutions have numbers that cannot be read"));
  EXPECT_THAT(result.err, HasSubstr("bad.json: problem 3, SQP(Multistart10), waypoint 0: number 1 is '1e400'"));
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report.at("methods")[0].at("solved"), 49);
  EXPECT_EQ(report.at("methods")[0].at("problems"), 50);
  EXPECT_EQ(report.at("differing_definitions").size(), 0U);
}

TEST_F(FileCommands, DatasetInfoAndHashCheck) {
  const auto folder = std::filesystem::path(SourceFolder()) / "data" / "garage-small";
  const auto info = Run({"dataset", "info", folder.string(), "--format", "json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_EQ(nlohmann::json::parse(info.out)[0].at("hash").get<std::string>().size(), 64U);
  EXPECT_EQ(Run({"dataset", "hash", folder.string(), "--check"}).exit_code, 0);
}

TEST_F(FileCommands, DatasetInfoHasTheJointsInTheOrderOfSolutions) {
  const auto folder = (std::filesystem::path(SourceFolder()) / "data" / "garage-small").string();
  const auto joints = nlohmann::json::parse(Run({"dataset", "info", folder, "--format", "json"}).out)[0].at("joints");
  ASSERT_EQ(joints.size(), 29U);
  EXPECT_EQ(joints[0], (nlohmann::json{{"index", 0},
                                       {"joint", "back_lbz"},
                                       {"type", "revolute"},
                                       {"lower", joints[0].at("lower")},
                                       {"upper", joints[0].at("upper")},
                                       {"unit", "rad"}}));
  EXPECT_LT(joints[0].at("lower").get<double>(), joints[0].at("upper").get<double>());
  EXPECT_EQ(joints[10].at("joint"), "hokuyo_joint");
  EXPECT_TRUE(joints[10].at("lower").is_null());
  const auto text = Run({"dataset", "info", folder});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("back_lbz"), HasSubstr("continuous"),
                              HasSubstr("position x y z (29-31, m), quaternion w x y z (32-35)")));
}

TEST_F(FileCommands, DatasetHashFindsAndMendsAChange) {
  const auto copy = folder_.path() / "copy";
  std::filesystem::copy(std::filesystem::path(SourceFolder()) / "data" / "garage-small", copy,
                        std::filesystem::copy_options::recursive);
  std::ofstream(copy / "scene.yaml", std::ios::app) << "# one more line\n";
  const auto check = Run({"dataset", "hash", copy.string(), "--check"});
  EXPECT_EQ(check.exit_code, 5);
  EXPECT_THAT(check.out, HasSubstr("differs"));
  EXPECT_EQ(Run({"dataset", "info", copy.string()}).exit_code, 2);
  EXPECT_EQ(Run({"dataset", "hash", copy.string()}).exit_code, 0);
  EXPECT_EQ(Run({"dataset", "hash", copy.string(), "--check"}).exit_code, 0);
  EXPECT_EQ(Run({"dataset", "info", copy.string()}).exit_code, 0);
}

}  // namespace
}  // namespace legopt::client
