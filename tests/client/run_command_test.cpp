// Policy: `legopt run` gives a judged table from one command, leaves no process behind whatever happens, and goes on
// where it was stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "client/result_source.h"
#include "program_run.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class RunCommand : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* program : {"legopt-server", "legopt-worker"}) {
      if (!std::filesystem::exists(BuiltProgram(program))) GTEST_SKIP() << program << " is not built";
    }
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
  }

  std::string Suite(int repetitions) {
    const auto file = folder_.path() / "small.yaml";
    std::ofstream(file)
        << "tasks: posture\nproblems: [0-2]\nmethods: [{solver: sqp}]\nlimits: {wall_time_s: 20}\nrepetitions: "
        << repetitions << "\n";
    return file.string();
  }

  ProgramResult Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "run");
    return RunLegopt(arguments, folder_.path());
  }

  std::int64_t Count(const std::string& sql) {
    return OpenResults({Db(), {}})->Query("SELECT count(*) AS n FROM " + sql).At(0, "n").get<std::int64_t>();
  }

  std::string Db() const { return (folder_.path() / "run.sqlite").string(); }

  TemporaryFolder folder_;
};

TEST_F(RunCommand, EndsWithTheTable) {
  const auto result = Run({Suite(1), "--db", Db(), "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = nlohmann::json::parse(result.out);
  EXPECT_EQ(table.at("jobs"), 6);
  EXPECT_EQ(table.at("finished"), 6);
  EXPECT_THAT(result.err, AllOf(HasSubstr("6 of 6 jobs"), HasSubstr("legopt table 1 --db")));
  EXPECT_EQ(Count("results"), 6);
}

TEST_F(RunCommand, NamesTheDatabaseAfterSuiteAndTime) {
  ASSERT_EQ(Run({Suite(1)}).exit_code, 0);
  int databases = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
    const auto name = entry.path().filename().string();
    if (name.rfind("small-20", 0) == 0 && entry.path().extension() == ".sqlite") ++databases;
  }
  EXPECT_EQ(databases, 1);
}

TEST_F(RunCommand, TheSameContentIsNotComputedTwice) {
  ASSERT_EQ(Run({Suite(1), "--db", Db()}).exit_code, 0);
  const auto again = Run({Suite(1), "--db", Db()});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.err, HasSubstr("in the database already"));
  EXPECT_EQ(Count("experiments"), 1);
  EXPECT_EQ(Count("attempts"), 6);
  ASSERT_EQ(Run({Suite(1), "--db", Db(), "--new"}).exit_code, 0);
  EXPECT_EQ(Count("experiments"), 2);
}

TEST_F(RunCommand, ExportAndEvaluateAgree) {
  ASSERT_EQ(Run({Suite(1), "--db", Db()}).exit_code, 0);
  const auto exported = RunLegopt({"export", "1", "--db", Db(), "--out", "out.json"}, folder_.path());
  ASSERT_EQ(exported.exit_code, 0) << exported.err;
  const auto judged = RunLegopt({"evaluate", "out.json", "--format", "json"}, folder_.path());
  ASSERT_EQ(judged.exit_code, 0) << judged.err;
  const auto report = nlohmann::json::parse(judged.out);
  EXPECT_EQ(report.at("solutions").size(), 6U);
  EXPECT_TRUE(report.at("warnings").empty()) << report.at("warnings");
  std::int64_t solved = 0;
  for (const auto& method : report.at("methods")) solved += method.at("solved").get<std::int64_t>();
  EXPECT_EQ(solved, Count("results WHERE verdict_literal = 'success'"));
}

TEST_F(RunCommand, InterruptedItKeepsWhatIsDoneAndGoesOnLater) {
  const int kRepetitions = 500;
  const auto suite = Suite(kRepetitions);
  {
    RunningProgram program(BuiltProgram("legopt"), {"run", suite, "--db", Db()}, folder_.path());
    ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
    ::kill(program.pid(), SIGINT);
    const auto result = program.Wait();
    EXPECT_EQ(result.exit_code, 8) << result.err;
    EXPECT_THAT(result.err, HasSubstr("To go on"));
    EXPECT_THAT(result.out, HasSubstr("left)"));
  }
  const auto done = Count("results");
  EXPECT_LT(done, 6 * kRepetitions);
  const auto result = Run({suite, "--db", Db()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Count("experiments"), 1);
  EXPECT_EQ(Count("results"), 6 * kRepetitions);
}

TEST_F(RunCommand, KilledChildrenAreStartedAgain) {
  const int kRepetitions = 300;
  RunningProgram program(BuiltProgram("legopt"), {"run", Suite(kRepetitions), "--db", Db()}, folder_.path());
  ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
  for (const char* name : {"legopt-worker", "legopt-server"}) {
    const auto children = ChildrenOf(program.pid(), name);
    ASSERT_EQ(children.size(), 1U) << name;
    ::kill(children[0], SIGKILL);
    ASSERT_TRUE(program.WaitForError(std::string(name) + " ended with signal 9"));
  }
  const auto result = program.Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(Count("results"), 6 * kRepetitions);
}

TEST_F(RunCommand, KilledItLeavesNoProcessBehind) {
  std::vector<int> children;
  {
    RunningProgram program(BuiltProgram("legopt"), {"run", Suite(500), "--db", Db()}, folder_.path());
    ASSERT_TRUE(program.WaitForError("Ctrl-C stops"));
    for (const char* name : {"legopt-worker", "legopt-server"}) {
      for (const int pid : ChildrenOf(program.pid(), name)) children.push_back(pid);
    }
    ASSERT_EQ(children.size(), 2U);
    ::kill(program.pid(), SIGKILL);
  }
  for (const int pid : children) WaitForEnd(pid);
}

TEST_F(RunCommand, UnwritableDatabase) {
  const auto result = Run({Suite(1), "--db", "/nowhere/results.sqlite"});
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, AllOf(HasSubstr("legopt: error: "), HasSubstr("/nowhere")));
}

}  // namespace
}  // namespace legopt::client
