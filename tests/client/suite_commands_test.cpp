// Policy: `run` and `submit` check their input before anything is started or sent. Errors name file and key.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "command_line_fixture.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

using SuiteCommands = CommandLine;

TEST_F(SuiteCommands, SuiteThatIsAFolder) {
  std::filesystem::create_directory(folder_.path() / "suite.yaml");
  for (const char* name : {"suite.yaml", "./suite.yaml"}) {
    ExpectError(Run({"submit", name}), 2, std::string("'") + name + "' is a folder, not an experiment file");
  }
}

TEST_F(SuiteCommands, DryRunChecksWhatTheServerWould) {
  const auto suite =
      Write("long.yaml", "name: " + std::string(5000, 'n') + "\ntasks: posture\nmethods: [{solver: sqp}]\n");
  for (const char* command : {"submit", "run"}) {
    ExpectError(Run({command, "--dry-run", suite}), 2, "long.yaml:1: name: is 5000 bytes long, at most 200");
  }
}

TEST_F(SuiteCommands, NamesOfFilesAreCheckedLikeThoseInThem) {
  const std::string text = "tasks: posture\nmethods: [{solver: sqp}]\n";
  ExpectError(Run({"submit", "--dry-run", Write("\xff.yaml", text)}), 2, "name: is not UTF-8");
  ExpectError(Run({"submit", "--dry-run", Write(std::string(220, 'n') + ".yaml", text)}), 2, "200 bytes, it has 220");
}

TEST_F(SuiteCommands, DryRunTellsWhatIsLeftOut) {
  const auto result = Run({"submit", "--dry-run", "quick", "--problems", "0-5"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("left out: no motion is left: all 6 chosen problems are longer than 50 stances"));
  EXPECT_THAT(result.err, StartsWith("legopt: warning: no motion is left"));
  const auto usual = Run({"submit", "--dry-run", "quick"});
  EXPECT_THAT(usual.out, HasSubstr("motion problems are longer than 50 stances"));
  EXPECT_EQ(usual.err, "") << "as the suite says";
}

TEST_F(SuiteCommands, RunHasADryRun) {
  const auto result = Run({"run", "--dry-run", "quick", "--workers", "3", "--db", "my.sqlite"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("550 jobs: "), HasSubstr("at most "), HasSubstr("with 3 workers"),
                                HasSubstr("legopt-server --db my.sqlite (new)"), HasSubstr("legopt-worker --slots 3"),
                                HasSubstr("nothing was started")));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
  const auto json = Run({"run", "--dry-run", "quick", "--format", "json"});
  EXPECT_EQ(nlohmann::json::parse(json.out).at("jobs"), 550);
}

TEST_F(SuiteCommands, SuitesAreNarrowedByMethodFigures) {
  const auto methods = [this](const std::string& flag, const std::string& value) {
    const auto result = Run({"submit", "--dry-run", "quick", "--format", "json", flag, value});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out).at("spec").at("methods");
  };
  const auto restarts = methods("--multi-starts", "10");
  EXPECT_EQ(restarts.size(), 3U);
  for (const auto& method : restarts) EXPECT_EQ(method.at("multi_starts"), 10);
  const auto sampled = methods("--sample-size", "80");
  ASSERT_EQ(sampled.size(), 1U);
  EXPECT_EQ(sampled[0].at("sample_size"), 80);
  ExpectError(Run({"submit", "--dry-run", "quick", "--multi-starts", "7"}), 2,
              "--multi-starts: is not in the suite (got '7')");
}

TEST_F(SuiteCommands, UnknownSuiteNamesTheEmbeddedOnes) {
  ExpectError(Run({"submit", "--dry-run", "quikc"}), 2, "quick");
}

TEST_F(SuiteCommands, UnknownSuiteKey) {
  const auto suite = Write("bad.yaml", "tasks: posture\nmethdos: []\n");
  for (const char* command : {"run", "submit"})
    ExpectError(Run({command, suite}), 2, "bad.yaml:2: methdos: unknown key");
}

TEST_F(SuiteCommands, MissingDataset) {
  const auto suite = Write("suite.yaml", "tasks: posture\nmethods: [{solver: sqp}]\n");
  ExpectError(Run({"submit", "--dry-run", suite, "--dataset", "/nowhere/data"}), 2, "/nowhere/data");
  ExpectError(Run({"submit", "--dry-run", suite}, {{"LEGOPT_DATA", "/nowhere/data"}}), 2, "LEGOPT_DATA");
}

TEST_F(SuiteCommands, DryRunCountsAndSubmitsNothing) {
  const auto result = Run({"submit", "--dry-run", "quick", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_GT(json.at("jobs").get<int>(), 0);
  EXPECT_EQ(json.at("spec").at("spec_version"), 1);
  EXPECT_EQ(json.at("submission_id").get<std::string>().size(), 32U);
}

TEST_F(SuiteCommands, ListsDoNotSwallowTheSuite) {
  const auto result =
      Run({"submit", "--dry-run", "--problems", "0-2,5", "--initializations", "good", "quick", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("spec").at("tasks")[0].at("problems"), (nlohmann::json{0, 1, 2, 5}));
}

}  // namespace
}  // namespace legopt::client
