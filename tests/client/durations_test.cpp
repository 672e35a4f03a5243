// `legopt evaluate --durations`: shortest durations of motions in a solution file.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "command_line_fixture.h"
#include "legopt/judge/solution_file.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

class Durations : public CommandLine {
 protected:
  Durations() : file_(ReadSolutions(dataset_ + "/solutions-motion.json")) { file_.problems.resize(2); }

  ProgramResult Evaluate(const std::string& rows) {
    const std::string path = (folder_.path() / "motions.json").string();
    WriteSolutions(path, file_);
    return Run({"evaluate", path, "--dataset", dataset_, "--durations", rows, "--format", "json"});
  }
  nlohmann::json Rows(const std::string& rows) { return nlohmann::json::parse(Evaluate(rows).out); }

  const std::string dataset_ = SourceFolder() + "/data/contacts-quadruped";
  SolutionFile file_;
};

TEST_F(Durations, OfMotionsHaveLimitsThatSumUpToTheWhole) {
  const nlohmann::json rows = Rows("motions");
  ASSERT_EQ(rows.size(), 2u);
  for (const nlohmann::json& row : rows) {
    EXPECT_GT(row["duration_s"].get<double>(), 0.1);
    EXPECT_NEAR(row["velocity"].get<double>() + row["torque"].get<double>() + row["contact"].get<double>(), 1.0, 1e-9);
    EXPECT_TRUE(row["optimal"]);
    EXPECT_TRUE(row["fault"].is_null());
    EXPECT_TRUE(row["blocked_by"].is_null());
  }
}

TEST_F(Durations, OfMethodsAreMediansOfExecutableMotions) {
  const double first = Rows("motions")[0]["s_per_stance"];
  file_.problems.resize(1);
  const nlohmann::json rows = Rows("methods");
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_EQ(rows[0]["motions"], 1);
  EXPECT_EQ(rows[0]["executable"], 1);
  EXPECT_DOUBLE_EQ(rows[0]["median_s_per_stance"], first);
}

TEST_F(Durations, FaultsNameTheReasonAndDoNotHideOtherMotions) {
  file_.problems[0].solutions[0].waypoints.pop_back();
  const nlohmann::json rows = Rows("motions");
  EXPECT_TRUE(rows[0]["duration_s"].is_null());
  EXPECT_FALSE(rows[0]["fault"].get<std::string>().empty());
  EXPECT_FALSE(rows[1]["duration_s"].is_null());
}

TEST_F(Durations, MotionsAtRestTakeNoTime) {
  for (Eigen::VectorXd& x : file_.problems[0].solutions[0].waypoints) {
    const double time = x[x.size() - 1];
    x = file_.problems[0].solutions[0].waypoints[0];
    x[x.size() - 1] = time;
  }
  EXPECT_EQ(Rows("motions")[0]["duration_s"], 0.0);
  EXPECT_EQ(Rows("methods")[0]["executable"], 2);
}

TEST_F(Durations, PosturesHaveNone) {
  file_ = ReadSolutions(dataset_ + "/solutions-posture.json");
  const ProgramResult result = Evaluate("methods");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("postures, which have no duration"));
}

TEST_F(Durations, UnknownRowsAreAUsageError) {
  const ProgramResult result = Evaluate("problems");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("motions"));
}

}  // namespace
}  // namespace legopt::client
