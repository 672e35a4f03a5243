// Policy: `generate` only creates new folders, reproduces its output byte by byte, and names errors in its arguments.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include "app/exit_codes.h"
#include "program_run.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/worldgen/plain_dataset.h"

namespace legopt::client {
namespace {

using app::ExitCode;
using testing::HasSubstr;

TEST(GenerateCommand, ScenarioRepeatsByteByByteAndNothingIsOverwritten) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> words = {"generate", "scenario", "--kind", "house", "--seed", "5", "--no-pictures"};
  const auto run = [&](const std::string& out) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--out", out});
    return RunLegopt(all, folder.path());
  };
  const ProgramResult first = run("a");
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("walkable_share"));
  ASSERT_EQ(run("b").exit_code, 0);
  for (const char* file : {"scene.ply", "scenario.json"}) {
    EXPECT_EQ(test::ReadText(folder.path() / "a" / file), test::ReadText(folder.path() / "b" / file)) << file;
  }
  const ProgramResult again = run("a");
  EXPECT_EQ(again.exit_code, kUsage);
  EXPECT_THAT(again.err, HasSubstr("exists already"));
}

TEST(GenerateCommand, AnInterruptionKeepsWhatIsDone) {
  const test::TemporaryFolder folder;
  const std::vector<std::string> words = {"generate",  "problems", "--from", SourceFolder() + "/data/garage-small",
                                          "--stances", "2000",     "--out",  "a"};
  RunningProgram program(BuiltProgram("legopt"), words, folder.path());
  ASSERT_TRUE(program.WaitForError("stances 0 of 2000"));
  ::kill(program.pid(), SIGINT);
  const ProgramResult result = program.Wait();
  EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kInterrupted)) << result.err;
  EXPECT_THAT(result.err, HasSubstr("the same command continues"));
  EXPECT_THAT(result.err, HasSubstr("a.partial"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "a.partial"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "a"));
}

// No plan can reach a missing floor, but the stances have been certified and are kept.
TEST(GenerateCommand, ARefusalAfterTheStancesKeepsThemForFewerPlans) {
  const test::TemporaryFolder folder;
  test::WritePlainDataset(folder.path() / "plain", test::kTwoLevels);
  const auto run = [&](const std::string& different) {
    return RunLegopt({"generate", "problems", "--from", "plain", "--stances", "12", "--same-floor", "1",
                      "--different-floors", different, "--postures", "1", "--out", "a"},
                     folder.path());
  };
  const ProgramResult refused = run("3");
  EXPECT_EQ(refused.exit_code, kUsage);
  EXPECT_THAT(refused.err, HasSubstr("with another number of plans"));
  const ProgramResult made = run("0");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_THAT(made.out, testing::Not(HasSubstr("stances: "))) << "none was sampled again";
}

TEST(GenerateCommand, CandidatesBecomeADatasetForTheWorkerPool) {
  const test::TemporaryFolder folder;
  const ProgramResult made = RunLegopt(
      {"generate", "candidates", "--stances", "5", "--from", SourceFolder() + "/data/garage-small", "--out", "a"},
      folder.path());
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ProgramResult info = RunLegopt({"dataset", "info", "a", "--format", "csv"}, folder.path());
  EXPECT_THAT(info.out, HasSubstr(",5,0,"));  // posture and motion problems
}

TEST(GenerateCommand, BadArgumentsAreNamed) {
  const test::TemporaryFolder folder;
  const auto error_of = [&](const std::vector<std::string>& words) {
    const ProgramResult result = RunLegopt(words, folder.path());
    EXPECT_EQ(result.exit_code, kUsage) << result.err;
    return result.err;
  };
  EXPECT_THAT(error_of({"generate", "scenario", "--kind", "hous", "--out", "a"}), HasSubstr("house"));
  EXPECT_THAT(error_of({"generate", "scenario", "--level", "hardest", "--out", "a"}), HasSubstr("hard"));
  EXPECT_THAT(error_of({"generate", "scenario"}), HasSubstr("--out"));
  EXPECT_THAT(error_of({"generate", "problems", "--from", "nowhere", "--out", "a"}), HasSubstr("nowhere"));
  EXPECT_THAT(error_of({"generate", "dataset", "--postures", "-3", "--out", "a"}), HasSubstr("--postures"));
  EXPECT_THAT(error_of({"generate", "problems", "--from", "x", "--proven", "y", "--stances", "9", "--out", "a"}),
              HasSubstr("--proven"));
  const std::string small = SourceFolder() + "/data/garage-small";
  EXPECT_THAT(error_of({"generate", "problems", "--from", small, "--proven", "y.json", "--out", "a"}),
              HasSubstr("y.json"));
  EXPECT_THAT(error_of({"generate", "problems", "--from", small, "--radius", "0.05", "--out", "a"}),
              HasSubstr("--radius"));
  EXPECT_THAT(error_of({"generate", "dataset", "--slope", "2", "--out", "a"}), HasSubstr("--slope"));
  EXPECT_THAT(error_of({"generate", "scenario", "--seed", "-1", "--out", "a"}), HasSubstr("--seed"));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace legopt::client
