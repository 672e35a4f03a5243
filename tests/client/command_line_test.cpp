// Policy: every error is one line "legopt: error: ..." with its own exit code, and standard output contains only
// results. This file tests usage, help, and behaviour common to all commands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>

#include "command_line_fixture.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST_F(CommandLine, HelpNamesCommandsAndExitCodes) {
  const auto result = Run({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"run",     "submit",      "watch",      "status",       "list",
                           "show",    "cancel",      "pause",      "resume",       "edit",
                           "retry",   "table",       "query",      "evaluate",     "export",
                           "dataset", "service",     "Exit codes", "Experiments:", "database unusable",
                           "help",    "LEGOPT_DATA", "Results:",   "Datasets:",    "--help-network"}) {
    EXPECT_THAT(result.out, HasSubstr(word));
  }
}

// Each group and the number of all commands stay short enough to read.
TEST_F(CommandLine, HelpListsAtMost29Commands) {
  const std::string help = Run({"--help"}).out;
  int commands = 0;
  bool listed = false;
  std::istringstream lines(help.substr(help.find("Experiments:")));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("  ") && line.size() > 2 && line[2] >= 'a' && line[2] <= 'z') ++commands;
    listed = listed || line.starts_with("  service ");
  }
  EXPECT_TRUE(listed);
  EXPECT_LE(commands, 29) << help;
}

TEST_F(CommandLine, NetworkOptionsHaveAHelpOfTheirOwn) {
  EXPECT_THAT(Run({"status", "--help"}).out, AllOf(HasSubstr("--help-network"), Not(HasSubstr("--port"))));
  const auto network = Run({"status", "--help-network"});
  EXPECT_EQ(network.exit_code, 0);
  EXPECT_THAT(network.out, AllOf(HasSubstr("--port"), HasSubstr("--access"), Not(HasSubstr("--format"))));
  EXPECT_THAT(Run({"evaluate", "--help"}).out, Not(HasSubstr("--help-network")));
  EXPECT_THAT(Run({"evaluate", "--help-network"}).out, HasSubstr("'legopt evaluate' has no network options"));
}

TEST_F(CommandLine, FormerCommandsNameTheirSuccessors) {
  const std::vector<std::pair<std::string, std::string>> words = {
      {"hold", "pause --now"},         {"release", "resume"},
      {"rename", "edit --name"},       {"tag", "edit --tag"},
      {"priority", "edit --priority"}, {"logs", "show --logs"},
      {"trace", "show --trace"},       {"doctor", "service doctor"},
      {"events", "service events"},    {"drain", "service drain"},
      {"tap", "service tap"},          {"keygen", "service keygen"},
      {"backup", "service backup"},    {"restore", "service restore"},
      {"delete", "service delete"},    {"solver", "service check-solver"}};
  for (const auto& [former, now] : words) {
    const std::string error = Run({former, "1"}).err;
    EXPECT_THAT(error, HasSubstr("unknown command '" + former + "'; ")) << former;
    EXPECT_THAT(error, HasSubstr(now)) << former;
  }
}

TEST_F(CommandLine, ShowRefusesOptionsOfTheTrace) {
  ExpectError(Run({"show", "1", "--columns", "cost"}), 2, "--columns is possible only with --trace");
  ExpectError(Run({"show", "1", "--logs", "--format", "csv"}), 2, "--format csv is possible only with --trace");
  ExpectError(Run({"show", "1", "--logs", "--trace"}), 2, "exclude each other");
}

TEST_F(CommandLine, VersionIsPrinted) { EXPECT_THAT(Run({"--version"}).out, StartsWith("legopt ")); }

TEST_F(CommandLine, WrongUsage) {
  ExpectError(Run({"tabel"}), 2, "did you mean 'table'?");
  ExpectError(Run({"table", "--format", "jsn"}), 2, "did you mean 'json'?");
  ExpectError(Run({"table", "--nonsense"}), 2, "--nonsense");
  ExpectError(Run({"table", "--rule", "loose"}), 2, "loose");
  ExpectError(Run({"cancel"}), 2, "ID");
  ExpectError(Run({"edit", "1"}), 2, "give --name, --tag, --untag or --priority");
  ExpectError(Run({"edit", "1", "--priority", "1001"}), 2, "1001");
  ExpectError(Run({"run"}), 2, "SUITE");
}

TEST_F(CommandLine, HelpIsACommandAndTheAnswerToNothing) {
  EXPECT_EQ(Run({"help"}).out, Run({"--help"}).out);
  EXPECT_EQ(Run({"help", "run"}).out, Run({"run", "--help"}).out);
  EXPECT_EQ(Run({"version"}).out, Run({"--version"}).out);
  const auto bare = Run({});
  EXPECT_EQ(bare.exit_code, 2);
  EXPECT_EQ(bare.out, Run({"--help"}).out);
  EXPECT_EQ(bare.err, "");
  const auto dataset = Run({"dataset"});
  EXPECT_EQ(dataset.exit_code, 2);
  EXPECT_EQ(dataset.out, Run({"dataset", "--help"}).out);
}

TEST_F(CommandLine, OtherWordsForCommands) {
  const std::vector<std::pair<std::string, std::string>> words = {
      {"ls", "list"}, {"kill", "cancel"}, {"stop", "cancel"}, {"eval", "evaluate"}, {"ps", "status"}, {"sql", "query"}};
  for (const auto& [typed, command] : words) {
    ExpectError(Run({typed, "1"}), 2, "unknown command '" + typed + "'; did you mean '" + command + "'?");
  }
  ExpectError(Run({"dataset", "chek", "x"}), 2, "did you mean 'check'?");
}

TEST_F(CommandLine, MisspeltOptionsGetTheirNearestAndTheHelpOfTheirCommand) {
  ExpectError(Run({"run", "--mehods", "SQP", "quick"}), 2,
              "unknown option '--mehods'; did you mean '--methods'?; see 'legopt run --help'");
  ExpectError(Run({"table", "a", "b", "c"}), 2, "see 'legopt table --help'");
}

TEST_F(CommandLine, NumbersAreAskedForInPlainWords) {
  const std::string whole = "must be a whole number of at least ";
  ExpectError(Run({"show", "abc"}), 2, "JOB: " + whole + "1 (got 'abc')");
  ExpectError(Run({"show", "0"}), 2, "JOB: " + whole + "1 (got '0')");
  ExpectError(Run({"table", "abc"}), 2, "ID: " + whole + "1 (got 'abc')");
  ExpectError(Run({"watch", "x"}), 2, "ID: " + whole + "1 (got 'x')");
  ExpectError(Run({"cancel", "-1"}), 2, "ID: " + whole + "1 (got '-1')");
  ExpectError(Run({"generate", "scenario", "--seed", "-1", "--out", "x"}), 2, "--seed: " + whole + "0 (got '-1')");
  ExpectError(Run({"status", "--port", "x"}), 2, "--port: must be a whole number (got 'x')");
  ExpectError(Run({"run", "quick", "--workers", "0"}), 2, "--workers: must be a whole number from 1 to 1024 (got '0')");
}

TEST_F(CommandLine, EmptyAndOverlongTextsAreTheUsersNotTheNetworks) {
  ExpectError(Run({"query", ""}), 2, "SQL is empty");
  ExpectError(Run({"query", " ; "}), 2, "SQL is empty");
  ExpectError(Run({"pause", "1", "--reason", ""}), 2, "--reason: is empty");
  ExpectError(Run({"pause", "1", "--reason", std::string(1001, 'x')}), 2, "--reason: is 1001 bytes long; at most 1000");
}

// Commands with much and with little output write to a device that is always full.
TEST_F(CommandLine, FullStandardOutputHasOneCode) {
  const auto file = Database();
  const std::vector<std::string> commands = {"table --db " + file,
                                             "table --format csv --db " + file,
                                             "list --db " + file,
                                             "query 'SELECT 1' --db " + file,
                                             "submit --dry-run quick",
                                             "--help",
                                             "help run",
                                             "version",
                                             "",
                                             "dataset info",
                                             "service doctor"};
  for (const auto& command : commands) {
    const auto result =
        RunningProgram("/bin/sh", {"-c", BuiltProgram("legopt").string() + " " + command + " > /dev/full"},
                       folder_.path())
            .Wait();
    EXPECT_EQ(result.exit_code, 2) << command << ": " << result.err;
    EXPECT_THAT(result.err, HasSubstr("standard output cannot be written; is the disk full?")) << command;
  }
}

TEST_F(CommandLine, DoctorTellsTheEmbeddedDataFolder) {
  const auto result = Run({"service", "doctor"});
  EXPECT_THAT(result.out, HasSubstr("embedded suites and datasets in "));
  EXPECT_THAT(Run({"service", "doctor"}, {{"LEGOPT_DATA", "/nowhere"}}).out, HasSubstr("/nowhere"));
  EXPECT_THAT(Run({"--help"}, {{"LEGOPT_DATA", "/nowhere"}}).out, HasSubstr("/nowhere"));
}

TEST_F(CommandLine, OutOfMemoryIsNoDefect) {
  const auto db = (folder_.path() / "test.sqlite").string();
  TestExperiment experiment;
  experiment.results = {{.problem = 0}};
  WriteTestDatabase(db, experiment);
  const std::string query =
      "query \"WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 1000000) SELECT i, "
      "printf('%0150d', i) FROM n\" --max-rows 1000000 --db " +
      db;
  const auto result =
      RunningProgram("/bin/sh", {"-c", "ulimit -v 220000; exec " + BuiltProgram("legopt").string() + " " + query},
                     folder_.path())
          .Wait();
  EXPECT_EQ(result.exit_code, 71) << result.err;
  EXPECT_THAT(result.err, HasSubstr("out of memory"));
}

TEST_F(CommandLine, ServerAndWorkerHaveTheSameManners) {
  for (const char* program : {"legopt-server", "legopt-worker"}) {
    if (!std::filesystem::exists(BuiltProgram(program))) GTEST_SKIP() << program << " is not built";
    const auto run = [&](const std::vector<std::string>& words) {
      return RunningProgram(BuiltProgram(program), words, folder_.path()).Wait();
    };
    const std::string begin = std::string(program) + ": error: ";
    const std::string end = "; see '" + std::string(program) + " --help'\n";
    auto result = run({"--prot", "7667"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err, begin + "unknown option '--prot'; did you mean '--port'?" + end);
    result = run({"--db", "x.sqlite", "--port", "abc"});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, AllOf(StartsWith(begin), testing::EndsWith(end)));
    EXPECT_EQ(run({"--help"}).exit_code, 0);
    EXPECT_EQ(run({"help"}).out, run({"--help"}).out);
    EXPECT_THAT(run({"--version"}).out, HasSubstr("legopt"));
  }
}

}  // namespace
}  // namespace legopt::client
