// Policy: the built program in a pseudo-terminal. Only there, text fits the width, is coloured and passes through the
// pager; exit codes are the same as without a terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "client/report/text_layout.h"
#include "terminal_run.h"
#include "test_database.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::Not;

constexpr char kEscape[] = "\033[";
constexpr char kNoTerminals[] = "no pseudo-terminal can be opened here; mount /dev/pts";

class TerminalCommand : public testing::Test {
 protected:
  void SetUp() override {
    TestExperiment experiment;
    experiment.methods = {{"SQP", 0}, {"SQP", 10}};
    for (int problem = 0; problem < kProblems; ++problem) {
      for (int method = 0; method < 2; ++method) {
        for (const char* start : {"good", "in_collision"}) {
          experiment.results.push_back({.method = method,
                                        .initialization = start,
                                        .problem = problem,
                                        .verdict = problem % 2 == method ? "com" : "success"});
        }
      }
    }
    WriteTestDatabase(file_, experiment);
  }

  ProgramResult Run(std::vector<std::string> arguments, const TerminalSize& size,
                    const std::map<std::string, std::string>& environment = {}) {
    arguments.insert(arguments.end(), {"--db", file_.string()});
    return RunInTerminal(BuiltProgram("legopt"), arguments, folder_.path(), size, environment);
  }

  ProgramResult Shell(const std::string& command) {
    const std::map<std::string, std::string> environment = {{"LEGOPT", BuiltProgram("legopt")}, {"DB", file_}};
    return RunningProgram("/bin/sh", {"-c", command}, folder_.path(), environment).Wait();
  }

  // Returns the widths of the lines without escape sequences.
  static std::vector<std::size_t> Widths(const std::string& text) {
    std::string plain;
    for (std::size_t at = 0; at < text.size(); ++at) {
      if (text.compare(at, 2, kEscape) == 0) {
        at = text.find('m', at);
      } else {
        plain += text[at];
      }
    }
    std::vector<std::size_t> widths;
    std::istringstream stream(plain);
    for (std::string line; std::getline(stream, line);) widths.push_back(DisplayWidth(line));
    return widths;
  }

  static constexpr int kProblems = 20;
  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "test.sqlite";
};

TEST_F(TerminalCommand, TablesFitTheTerminal) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  for (const unsigned short columns : {40, 80, 100, 120}) {
    const auto result = Run({"table"}, {columns, 200});
    EXPECT_EQ(result.exit_code, 0);
    EXPECT_THAT(Widths(result.out), Each(testing::Le(columns))) << result.out;
    EXPECT_THAT(result.out, HasSubstr("10/20"));
  }
  EXPECT_THAT(Widths(Run({"table"}, {80, 200}, {{"COLUMNS", "50"}}).out), Each(testing::Le(50U)));
  EXPECT_THAT(Widths(Run({"table", "--width", "60"}, {200, 200}).out), Each(testing::Le(60U)));
}

TEST_F(TerminalCommand, ListingsFitTheTerminal) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  const std::vector<std::vector<std::string>> commands = {
      {"list"}, {"show", "1"}, {"query", "SELECT spec_json, * FROM job_list JOIN experiments USING (experiment_id)"}};
  for (const auto& command : commands) {
    for (const unsigned short columns : {40, 80, 120}) {
      const auto result = Run(command, {columns, 60000});  // so many lines that no pager starts
      EXPECT_EQ(result.exit_code, 0);
      EXPECT_THAT(Widths(result.out), Each(testing::Le(columns))) << result.out;
    }
  }
  const auto chosen = RunLegopt({"list", "--columns", "job,state", "--db", file_.string()}, folder_.path());
  EXPECT_THAT(chosen.out, testing::StartsWith("job  state\n  1  done\n"));
  const auto unknown = RunLegopt({"list", "--columns", "stat", "--db", file_.string()}, folder_.path());
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("did you mean 'state'?"));
}

TEST_F(TerminalCommand, PipesAndFilesGetTheFullText) {
  const auto piped = RunLegopt({"table", "--db", file_.string()}, folder_.path(), {{"COLUMNS", "40"}});
  EXPECT_EQ(piped.exit_code, 0);
  EXPECT_THAT(piped.out, AllOf(HasSubstr("Multi-starts"), HasSubstr("Posture generation, init in collision"),
                               Not(HasSubstr(kEscape))));
  const auto narrow = RunLegopt({"table", "--width", "60", "--db", file_.string()}, folder_.path());
  EXPECT_THAT(Widths(narrow.out), Each(testing::Le(60U)));
}

TEST_F(TerminalCommand, TimesAreInTheUnitAskedFor) {
  const auto table = [&](const std::vector<std::string>& flags) {
    std::vector<std::string> arguments = {"table", "--db", file_.string()};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    return RunLegopt(arguments, folder_.path());
  };
  EXPECT_THAT(table({}).out, HasSubstr("Time (ms)"));
  EXPECT_THAT(table({"--time-unit", "s"}).out, HasSubstr("Time (s)"));
  EXPECT_EQ(table({"--time-unit", "min"}).exit_code, 2);
}

TEST_F(TerminalCommand, ColourIsForTerminals) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  const TerminalSize high{80, 200};  // no pager
  EXPECT_THAT(Run({"table"}, high).out, HasSubstr(kEscape));
  EXPECT_THAT(Run({"table"}, high, {{"NO_COLOR", "1"}}).out, Not(HasSubstr(kEscape)));
  EXPECT_THAT(Run({"table", "--color", "never"}, high).out, Not(HasSubstr(kEscape)));
  const std::vector<std::string> table = {"table", "--db", file_.string(), "--color", "always"};
  EXPECT_THAT(RunLegopt(table, folder_.path()).out, HasSubstr(kEscape));
}

TEST_F(TerminalCommand, LongTextGoesThroughThePager) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  const std::map<std::string, std::string> pager = {{"PAGER", "sed s/^/paged:/"}};
  const TerminalSize low{80, 5}, high{80, 200};
  EXPECT_THAT(Run({"table"}, low, pager).out, HasSubstr("paged:Method"));
  EXPECT_THAT(Run({"table"}, high, pager).out, Not(HasSubstr("paged:")));
  EXPECT_THAT(Run({"table", "--no-pager"}, low, pager).out, AllOf(HasSubstr("Method"), Not(HasSubstr("paged:"))));
  EXPECT_THAT(Run({"table"}, low, {{"PAGER", "sed s/^/no:/"}, {"LEGOPT_PAGER", "sed s/^/ours:/"}}).out,
              AllOf(HasSubstr("ours:Method"), Not(HasSubstr("no:"))));
  EXPECT_THAT(Run({"table"}, low, {{"LEGOPT_PAGER", "cat"}}).out, HasSubstr("Method"));
  // The terminal wraps 21 lines into many more.
  EXPECT_THAT(Run({"query", "SELECT hex(zeroblob(200)) FROM jobs LIMIT 20", "--format", "csv"}, {80, 40}, pager).out,
              HasSubstr("paged:"));
  const auto piped = RunLegopt({"table", "--db", file_.string()}, folder_.path(), {{"PAGER", "sed s/^/paged:/"}});
  EXPECT_THAT(piped.out, Not(HasSubstr("paged:")));
}

TEST_F(TerminalCommand, ExitCodesAreThoseWithoutAPager) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  const TerminalSize low{80, 5};
  EXPECT_EQ(Run({"table"}, low, {{"PAGER", "cat >/dev/null; exit 7"}}).exit_code, 0);
  EXPECT_EQ(Run({"table"}, low, {{"PAGER", "true"}}).exit_code, 0);  // a pager that reads nothing
  EXPECT_EQ(Run({"table", "99"}, low, {{"PAGER", "sed s/^/paged:/"}}).exit_code, 2);
}

TEST_F(TerminalCommand, WithoutItsPagerTheTextIsShownAllTheSame) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  const auto result = Run({"table"}, {80, 5}, {{"PAGER", "no-such-pager-here"}});
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("Method"));
  const auto bare = Run({"table"}, {80, 5}, {{"PATH", "/nowhere"}});  // less is not found
  EXPECT_EQ(bare.exit_code, 0);
  EXPECT_THAT(bare.out, AllOf(HasSubstr("Method"), Not(HasSubstr("not found"))));
}

TEST_F(TerminalCommand, AReaderThatHasSeenEnoughIsNoError) {
  const std::string rows =
      "\"$LEGOPT\" query \"SELECT a.job_id, b.job_id FROM jobs a, jobs b\" --db \"$DB\" | head -n 1";
  for (const char* before : {"", "trap '' PIPE; "}) {
    const auto result = Shell(before + rows);
    EXPECT_EQ(result.err, "") << before;
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1);
  }
}

TEST_F(TerminalCommand, FindingsFitTheWidth) {
  if (!HasTerminals()) GTEST_SKIP() << kNoTerminals;
  const TerminalSize size{.columns = 80, .lines = 1000};
  const auto doctor = Run({"service", "doctor"}, size);
  EXPECT_THAT(doctor.out, HasSubstr("versions"));
  EXPECT_THAT(Widths(doctor.out), Each(testing::Le(size.columns))) << doctor.out;
  const std::string dataset = SourceFolder() + "/data/garage-easier";
  const auto check = RunInTerminal(BuiltProgram("legopt"), {"dataset", "check", dataset}, folder_.path(), size);
  EXPECT_EQ(check.exit_code, 0) << check.out;
  EXPECT_THAT(check.out, HasSubstr("quaternion order"));
  EXPECT_THAT(Widths(check.out), Each(testing::Le(size.columns))) << check.out;
}

}  // namespace
}  // namespace legopt::client
