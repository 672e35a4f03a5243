// `legopt evaluate --pushes`: pushes that solutions resist, in newtons, beside the judge's verdict.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command_line_fixture.h"
#include "legopt/judge/solution_file.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

class Pushes : public CommandLine {
 protected:
  Pushes() : file_(ReadSolutions(dataset_ + "/solutions-posture.json")) { file_.problems.resize(4); }

  ProgramResult Evaluate(const std::vector<std::string>& words) {
    const std::string path = (folder_.path() / "postures.json").string();
    WriteSolutions(path, file_);
    std::vector<std::string> all = {"evaluate", path, "--dataset", dataset_, "--format", "json"};
    all.insert(all.end(), words.begin(), words.end());
    return Run(all);
  }
  nlohmann::json Rows(const std::string& rows) { return nlohmann::json::parse(Evaluate({"--pushes", rows}).out); }

  const std::string dataset_ = SourceFolder() + "/data/contacts-humanoid";
  SolutionFile file_;
};

TEST_F(Pushes, OfSolutionsAreWithinEffortsAndByContactsAlone) {
  file_.problems[0].definition.stances[0].push_N = 5.0;
  const nlohmann::json rows = Rows("problems");
  ASSERT_EQ(rows.size(), 4U);
  for (const nlohmann::json& row : rows) {
    EXPECT_GE(row["push_N"].get<double>(), 0.0) << "the judge accepts these postures";
    EXPECT_EQ(row["asked_N"], row["problem"] == 0 ? nlohmann::json(5.0) : nlohmann::json());
    EXPECT_LE(row["push_N"].get<double>(), row["contacts_N"].get<double>() + 1e-6);
    EXPECT_EQ(row["direction_deg"].get<int>() % 45, 0);
    EXPECT_TRUE(row["fault"].is_null());
    EXPECT_LE(row["effort_share"].get<double>(), 1.001);
    EXPECT_GT(row["effort_share"].get<double>(), 0.05);
    EXPECT_EQ(row["verdict"], row["push_N"].get<double>() < 4.0 && row["problem"] == 0 ? "push" : "success");
  }
}

TEST_F(Pushes, AreTheOnesOfTheCheck) {
  const double push_N = Rows("problems")[0]["push_N"];
  file_.problems.resize(1);
  const auto verdict = [&](double asked_N) {
    file_.problems[0].definition.stances[0].push_N = asked_N;
    return nlohmann::json::parse(Evaluate({"--rule", "physical"}).out)["solutions"][0]["verdict_physical"];
  };
  EXPECT_EQ(verdict(push_N + 0.99), "success");
  EXPECT_EQ(verdict(push_N + 1.01), "push");
}

TEST_F(Pushes, OfMethodsAreOverThePosturesThatAreHeld) {
  const nlohmann::json all = Rows("problems");
  file_.problems[1].solutions[0].waypoints[0][0] += 2.0;            // a joint of the back
  file_.problems[1].solutions[0].waypoints[0].tail<7>()[0] += 5.0;  // and 5 m away
  file_.problems[2].solutions[0].waypoints.pop_back();
  const nlohmann::json rows = Rows("problems");
  EXPECT_TRUE(rows[1]["push_N"].is_null());
  EXPECT_TRUE(rows[1]["contacts_N"].is_null());
  EXPECT_THAT(rows[2]["fault"].get<std::string>(), HasSubstr("0 of 1 waypoints"));
  const nlohmann::json methods = Rows("methods");
  ASSERT_EQ(methods.size(), 1U);
  EXPECT_EQ(methods[0]["solutions"], 4);
  EXPECT_EQ(methods[0]["solved"], 2);
  EXPECT_EQ(methods[0]["held"], 2);
  EXPECT_EQ(methods[0]["largest_effort_share"].get<double>(),
            std::max(all[0]["effort_share"].get<double>(), all[3]["effort_share"].get<double>()));
  EXPECT_EQ(methods[0]["least_N"].get<double>(),
            std::min(all[0]["push_N"].get<double>(), all[3]["push_N"].get<double>()));
}

TEST_F(Pushes, OfMotionsAreTheLeastOfAllWaypoints) {
  file_ = ReadSolutions(dataset_ + "/solutions-motion.json");
  file_.problems.resize(1);
  const nlohmann::json rows = Rows("problems");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_GT(rows[0]["waypoints"].get<int>(), 1);
  EXPECT_GE(rows[0]["waypoint"].get<int>(), 0);
  EXPECT_LT(rows[0]["waypoint"].get<int>(), rows[0]["waypoints"].get<int>());
}

TEST_F(Pushes, ExcludeDurations) {
  EXPECT_EQ(Evaluate({"--pushes", "methods", "--durations", "methods"}).exit_code, 2);
}

}  // namespace
}  // namespace legopt::client
