// Policy: an invalid command line ends with status 2 and one line that names the input, the nearest valid word, and
// the help of that command. Requesting help is no error.
#include "app/arguments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line.h"
#include "app/network_flags.h"
#include "legopt/types/task.h"

namespace legopt::app {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr std::array<Synonym, 4> kSynonyms = {
    {{"kill", "cancel"}, {"ls", "list"}, {"rm", "missing"}, {"verify", "data check"}}};

// A program "prog" with the commands run, cancel, list and data {hash, check}.
class Arguments : public testing::Test {
 protected:
  struct Said {
    std::optional<int> status;
    std::string out, err;
  };

  Said Parse(std::vector<const char*> words) {
    Program program("prog", "A program");
    program.SetVersion("prog 7", "all of prog 7");
    program.RequireCommand();
    const Command run = program.AddCommand("run", "Runs");
    run.AddOption("SUITE", suite_, "Suite").Required();
    run.AddOption("--methods", methods_, "Methods");
    run.AddOption("--workers", workers_, "Workers").Check(WholeNumber(1, 16));
    run.AddOption("--ratio", ratio_, "Ratio");
    run.AddOption("--count", count_, "Count");
    run.AddList("--names", names_, "Names");
    run.AddOption("--every", every_, "Seconds").ValueMayBeLeftOut("2");
    run.AddEnum<Task>("--task", task_, "Task");
    run.AddChoice<int>("--unit", unit_, "Unit", {{"s", 1}, {"min", 60}});
    const Option fast = run.AddFlag("--fast", fast_, "Fast");
    run.AddFlag("--slow", slow_, "Slow").Excludes(fast);
    run.WhenChosen([this] { ++runs_; });
    run.AddOption("--host", host_, "Host | address").Group(kNetworkHeading);
    program.AddCommand("cancel", "Cancels").AddOption("ID", id_, "Id").Required();
    program.AddCommand("list", "Lists").AddOption("--format", format_, "Format");
    program.GroupCommands("Jobs");
    const Command data = program.AddCommand("data", "Data");
    data.RequireCommand();
    data.AddCommand("hash", "Hashes");
    data.AddCommand("check", "Checks");
    program.GroupCommands("Files");
    program.AddCommand("secret", "Hidden");
    program.GroupCommands("");
    program.AddFlagThroughout("--verbose", verbose_, "Verbose");
    words.insert(words.begin(), "/some/where/prog");
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Said said;
    said.status = ParseCommandLine(program, static_cast<int>(words.size()), words.data(), kSynonyms);
    said.out = testing::internal::GetCapturedStdout();
    said.err = testing::internal::GetCapturedStderr();
    return said;
  }

  // Expects status 2 and exactly this line.
  void Expect(const std::vector<const char*>& words, const std::string& cause, const std::string& help) {
    const Said said = Parse(words);
    EXPECT_EQ(said.status, 2);
    EXPECT_EQ(said.out, "");
    EXPECT_EQ(said.err, "prog: error: " + cause + "; see '" + help + " --help'\n");
  }

  std::string suite_, methods_, host_, format_;
  int workers_ = 0, id_ = 0;
  double ratio_ = 0;
  std::uint64_t count_ = 0;
  bool fast_ = false, slow_ = false, verbose_ = false;
  std::vector<std::string> names_;
  std::optional<double> every_;
  std::optional<Task> task_;
  int unit_ = 1;
  int runs_ = 0;
};

// CLI11 alone reads 010 as 8, 0x10 as 16 and, for unsigned numbers, -1 as the largest.
TEST_F(Arguments, NumbersAreDecimal) {
  EXPECT_FALSE(Parse({"run", "quick", "--workers", "010", "--ratio", "1e-1"}).status);
  EXPECT_EQ(workers_, 10);
  EXPECT_EQ(ratio_, 0.1);
  EXPECT_FALSE(Parse({"cancel", "+012"}).status);
  EXPECT_EQ(id_, 12);
  for (const char* word : {"0x10", " 5", "5 ", "1'0", "1e1", "5.0", "99999999999"}) {
    Expect({"cancel", word}, std::string("ID: must be a whole number (got '") + word + "')", "prog cancel");
  }
  for (const char* word : {"0x1p3", "nan", "inf", "1,5", " 1", "1e999"}) {
    Expect({"run", "quick", "--ratio", word}, std::string("--ratio: must be a number (got '") + word + "')",
           "prog run");
  }
  Expect({"run", "quick", "--count", "-1"}, "--count: must be a whole number of at least 0 (got '-1')", "prog run");
}

TEST_F(Arguments, GoodOnesGoOn) {
  const Said said = Parse({"run", "quick", "--methods=SQP", "--workers", "2"});
  EXPECT_FALSE(said.status) << said.err;
  EXPECT_EQ(suite_, "quick");
  EXPECT_EQ(methods_, "SQP");
  EXPECT_EQ(workers_, 2);
}

TEST_F(Arguments, TheCommandThatWasChosenIsCalled) {
  Parse({"list"});
  EXPECT_EQ(runs_, 0);
  Parse({"run", "quick", "--verbose"});
  EXPECT_EQ(runs_, 1);
  EXPECT_TRUE(verbose_);
  Parse({"run", "--help"});
  EXPECT_EQ(runs_, 1);
}

TEST_F(Arguments, AListTakesOneArgument) {
  EXPECT_FALSE(Parse({"run", "--names", "a,b", "quick"}).status);
  EXPECT_EQ(names_, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(suite_, "quick");
}

TEST_F(Arguments, AValueMayBeLeftOut) {
  EXPECT_FALSE(Parse({"run", "quick", "--every"}).status);
  EXPECT_EQ(every_, 2);
  EXPECT_FALSE(Parse({"run", "quick", "--every", "3"}).status);
  EXPECT_EQ(every_, 3);
}

TEST_F(Arguments, WordsBecomeValues) {
  EXPECT_FALSE(Parse({"run", "quick", "--task", "motion", "--unit", "min"}).status);
  EXPECT_EQ(task_, Task::kMotion);
  EXPECT_EQ(unit_, 60);
  Expect({"run", "quick", "--task", "moton"},
         "--task: 'moton' is not known; did you mean 'motion'? valid: posture, motion, continuous, balanced, timed",
         "prog run");
  Expect({"run", "quick", "--unit", "mn"}, "--unit: 'mn' is not known; did you mean 'min'? valid: s, min", "prog run");
  EXPECT_THAT(Parse({"run", "--help"}).out, HasSubstr("{posture, motion, continuous, balanced, timed}"));
}

TEST_F(Arguments, HelpOfEverythingAndOfOneCommand) {
  for (const auto& words : std::vector<std::vector<const char*>>{{"help"}, {"--help"}, {"-h"}}) {
    const Said said = Parse(words);
    EXPECT_EQ(said.status, 0);
    EXPECT_THAT(said.out, AllOf(HasSubstr("cancel"), HasSubstr("prog [OPTIONS]")));
  }
  for (const auto& words :
       std::vector<std::vector<const char*>>{{"help", "run"}, {"run", "--help"}, {"run", "x", "-h"}}) {
    const Said said = Parse(words);
    EXPECT_EQ(said.status, 0);
    EXPECT_THAT(said.out, AllOf(HasSubstr("prog run"), HasSubstr("--methods"), Not(HasSubstr("cancel"))));
  }
  EXPECT_THAT(Parse({"help", "data", "check"}).out, HasSubstr("prog data check"));
}

TEST_F(Arguments, HelpListsVisibleCommandsByGroup) {
  const std::string help = Parse({"--help"}).out;
  EXPECT_LT(help.find("Jobs:"), help.find("cancel"));
  EXPECT_LT(help.find("list"), help.find("Files:"));
  EXPECT_LT(help.find("Files:"), help.find("data"));
  EXPECT_THAT(help, Not(HasSubstr("secret")));
  EXPECT_FALSE(Parse({"secret"}).status);
}

TEST_F(Arguments, NetworkOptionsHaveAHelpOfTheirOwn) {
  EXPECT_THAT(Parse({"run", "--help"}).out, AllOf(HasSubstr("--help-network"), Not(HasSubstr("--host"))));
  EXPECT_THAT(Parse({"list", "--help"}).out, Not(HasSubstr("--help-network")));
  const Said network = Parse({"run", "--help-network"});
  EXPECT_EQ(network.status, 0);
  EXPECT_THAT(network.out, AllOf(HasSubstr("--host"), Not(HasSubstr("--methods"))));
  EXPECT_EQ(Parse({"--help-network", "run"}).out, network.out);
  EXPECT_EQ(Parse({"--help-network"}).out, "'prog' has no network options\n");
  EXPECT_EQ(Parse({"list", "--help-network"}).out, "'prog list' has no network options\n");
  EXPECT_FALSE(Parse({"run", "quick", "--host", "here"}).status);
  EXPECT_EQ(host_, "here");
}

TEST_F(Arguments, FormerCommandsNameTheWholeCommandThatReplacesThem) {
  Expect({"verify", "x"}, "unknown command 'verify'; use 'prog data check'", "prog");
}

TEST_F(Arguments, TheReferenceDescribesVisibleCommandsAndOptions) {
  const Said said = Parse({"help", "--markdown"});
  EXPECT_EQ(said.status, 0);
  EXPECT_THAT(said.out,
              AllOf(HasSubstr("## Jobs\n"), HasSubstr("### prog run\n\nRuns.\n"),
                    HasSubstr("    prog run SUITE [OPTIONS]\n"), HasSubstr("* `SUITE` TEXT: Suite; required\n"),
                    HasSubstr("### prog data check\n"), HasSubstr("[Network options](#network-options): `--host`.\n"),
                    HasSubstr("## Network options\n"), HasSubstr("* `--host` TEXT: Host | address\n")));
  EXPECT_THAT(said.out, AllOf(Not(HasSubstr("secret")), HasSubstr("* `--fast`: Fast\n")));
}

TEST_F(Arguments, HelpBehindAnOptionIsItsValue) {
  EXPECT_FALSE(Parse({"run", "--methods", "help", "version"}).status);
  EXPECT_EQ(methods_, "help");
  EXPECT_EQ(suite_, "version");
}

TEST_F(Arguments, VersionTellsMoreWhenAsked) {
  for (const std::vector<const char*>& words : std::vector<std::vector<const char*>>{
           {"--version", "--verbose"}, {"--verbose", "--version"}, {"version", "--verbose"}}) {
    const Said said = Parse(words);
    EXPECT_EQ(said.status, 0);
    EXPECT_EQ(said.out, "all of prog 7\n");
  }
}

TEST_F(Arguments, VersionAsOptionAndAsCommand) {
  for (const char* word : {"version", "--version"}) {
    const Said said = Parse({word});
    EXPECT_EQ(said.status, 0);
    EXPECT_EQ(said.out, "prog 7\n");
  }
}

TEST_F(Arguments, WithoutACommandTheHelpIsShownAndTheStatusIsThatOfWrongUsage) {
  const Said bare = Parse({});
  EXPECT_EQ(bare.status, 2);
  EXPECT_EQ(bare.err, "");
  EXPECT_THAT(bare.out, HasSubstr("cancel"));
  const Said data = Parse({"data"});
  EXPECT_EQ(data.status, 2);
  EXPECT_THAT(data.out, AllOf(HasSubstr("prog data"), HasSubstr("hash"), HasSubstr("check"), Not(HasSubstr("cancel"))));
}

TEST_F(Arguments, UnknownCommandsGetTheirNearest) {
  const std::string valid = "valid: run, cancel, list, data";
  Expect({"rnu"}, "unknown command 'rnu'; did you mean 'run'? " + valid, "prog");
  Expect({"help", "lst"}, "unknown command 'lst'; did you mean 'list'? " + valid, "prog");
  Expect({"zzzzzzzz"}, "unknown command 'zzzzzzzz'; " + valid, "prog");
  Expect({"data", "chek", "x"}, "unknown command 'chek'; did you mean 'check'? valid: hash, check", "prog data");
}

TEST_F(Arguments, OtherProgramsWordsGetOurs) {
  EXPECT_THAT(Parse({"kill", "1"}).err, HasSubstr("did you mean 'cancel'?"));
  EXPECT_THAT(Parse({"ls"}).err, HasSubstr("did you mean 'list'?"));
  EXPECT_THAT(Parse({"rm", "1"}).err, Not(HasSubstr("missing")));  // missing commands are not suggested
}

TEST_F(Arguments, MisspeltOptionsGetTheNearestOfTheirCommand) {
  Expect({"run", "--mehods", "SQP", "quick"}, "unknown option '--mehods'; did you mean '--methods'?", "prog run");
  Expect({"run", "quick", "--worker=2"}, "unknown option '--worker'; did you mean '--workers'?", "prog run");
  Expect({"run", "-methods", "x"}, "unknown option '-methods'; did you mean '--methods'?", "prog run");
  Expect({"cancel", "--methods", "x"}, "unknown option '--methods'", "prog cancel");
  Expect({"list", "--json"}, "unknown option '--json'; did you mean '--format json'?", "prog list");
  Expect({"run", "--json", "quick"}, "unknown option '--json'", "prog run");
  Expect({"--vresion"}, "unknown option '--vresion'; did you mean '--version'?", "prog");
  Expect({"--qqqqqqqqqqq", "run"}, "unknown option '--qqqqqqqqqqq'", "prog");
}

TEST_F(Arguments, ValuesThatLookLikeOptionsAreNone) {
  EXPECT_FALSE(Parse({"run", "--methods", "--mehods", "quick"}).status);
  EXPECT_EQ(methods_, "--mehods");
  EXPECT_FALSE(Parse({"cancel", "-3"}).status);
  EXPECT_EQ(id_, -3);
}

TEST_F(Arguments, WhatIsLeftOverIsNamedInTheOrderTyped) {
  Expect({"run", "quick", "b", "a"}, "unexpected arguments 'b', 'a'", "prog run");
  Expect({"list", "7"}, "unexpected argument '7'", "prog list");
}

TEST_F(Arguments, MissingThings) {
  Expect({"run"}, "SUITE is missing", "prog run");
  Expect({"run", "quick", "--methods"}, "--methods needs a value", "prog run");
}

TEST_F(Arguments, WrongValues) {
  Expect({"cancel", "abc"}, "ID: must be a whole number (got 'abc')", "prog cancel");
  Expect({"run", "q", "--ratio", "x"}, "--ratio: must be a number (got 'x')", "prog run");
  for (const char* wrong : {"0", "17", "many", "3.5", "99999999999999999999", "-1", ""}) {
    const std::string got = *wrong == '\0' ? "(got nothing)" : "(got '" + std::string(wrong) + "')";
    Expect({"run", "q", "--workers", wrong}, "--workers: must be a whole number from 1 to 16 " + got, "prog run");
  }
}

TEST_F(Arguments, ExclusiveOptions) {
  Expect({"run", "q", "--fast", "--slow"}, "--fast and --slow exclude each other", "prog run");
}

TEST_F(Arguments, WhatWasTypedCannotSteerTheTerminal) {
  EXPECT_THAT(Parse({"\x1b[31m"}).err, AllOf(HasSubstr("'\\x1b[31m'"), Not(HasSubstr("\x1b"))));
  EXPECT_THAT(Parse({"list", "a\nb"}).err, HasSubstr("'a\\nb'"));
}

TEST(Checks, SayWhatTheyTake) {
  EXPECT_EQ(WholeNumber(1).fault("x"), "must be a whole number of at least 1 (got 'x')");
  EXPECT_EQ(Number(0.01, 3600).fault("x"), "must be a number from 0.01 to 3600 (got 'x')");
  EXPECT_EQ(OneOf({"solid", "surface"}).fault("solit"),
            "'solit' is not known; did you mean 'solid'? valid: solid, surface");
}

TEST(Checks, TakeTheirRangeOnly) {
  const auto takes = [](const ValueCheck& check, const std::string& word) { return check.fault(word).empty(); };
  for (const char* word : {"1", "+2", "1024"}) EXPECT_TRUE(takes(WholeNumber(1, 1024), word)) << word;
  for (const char* word : {"0", "1025", "1e2", "0x10", " 1", "1 "})
    EXPECT_FALSE(takes(WholeNumber(1, 1024), word)) << word;
  for (const char* word : {"-5", "0", "5"}) EXPECT_TRUE(takes(WholeNumber(-5, 5), word)) << word;
  EXPECT_TRUE(takes(WholeNumber(0), "9223372036854775807"));
  EXPECT_FALSE(takes(WholeNumber(0), "9223372036854775808"));
  for (const char* word : {"nan", "inf", "1e9", ""}) EXPECT_FALSE(takes(Number(0, 10), word)) << word;
  EXPECT_TRUE(takes(OneOf({"a", "b"}), "b"));
}

TEST(Checks, WordsInSentences) {
  EXPECT_EQ(EnumNamesOf<Task>(), (std::vector<std::string>{"posture", "motion", "continuous", "balanced", "timed"}));
  EXPECT_EQ(Alternatives({"a", "b", "c"}), "a, b or c");
  EXPECT_EQ(Alternatives({"a"}), "a");
  EXPECT_EQ(Joined({"a", "b", "c"}), "a, b, c");
}

}  // namespace
}  // namespace legopt::app
