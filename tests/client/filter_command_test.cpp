// Policy: every command that reads results has the same filters, with the same errors. A command without a row below
// that reads results fails the last test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "command_line_fixture.h"
#include "legopt/dataset/dataset.h"
#include "tests/dataset/synthetic_dataset.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using Words = std::vector<std::string>;

// Output of a command that shows methods as "Adam" and "SQP". Words: DB, OTHER and SOLUTIONS are files, FOLDER the
// dataset.
struct Reader {
  Words command;
  bool has_properties = true;  // --multi-starts, --sample-size, --collision
  bool has_rows = true;        // --rows and --columns
};

const std::vector<Reader> kReaders = {
    {{"table", "--db", "DB"}},
    {{"table", "--db", "DB", "--format", "json"}},
    {{"table", "--db", "DB", "--statistics"}},
    {{"table", "--db", "DB", "--statistics", "--format", "json"}},
    {{"table", "--db", "DB", "--profile"}},
    {{"list", "--db", "DB"}},
    {{"list", "--db", "DB", "--format", "json"}},
    {{"compare", "DB", "OTHER", "--format", "json"}},
    {{"export", "--db", "DB", "--dataset", "FOLDER", "--out", "-"}, true, false},
    {{"evaluate", "SOLUTIONS", "--dataset", "FOLDER"}, false},
    {{"evaluate", "SOLUTIONS", "--dataset", "FOLDER", "--format", "json"}, false},
};

// Commands that write files, serve pages, or show or repeat single jobs.
const std::vector<Reader> kOthers = {
    {{"report", "--db", "DB", "--dataset", "FOLDER", "--out", "report.html"}, true, false},
    {{"serve", "--db", "DB", "--dataset", "FOLDER", "--http-port", "0"}, true, false},
    {{"view", "--problem", "0", "--db", "DB", "--dataset", "FOLDER", "--experiment", "1"}, true, false},
    {{"show", "--problem", "0", "--db", "DB"}, true, false},
    {{"replay", "--random", "1", "--db", "DB", "--dataset", "FOLDER"}, true, false},
};

class FilterCommand : public CommandLine {
 protected:
  void SetUp() override {
    const auto dataset = Dataset::Load(test::SyntheticFolder(data_.path()).path());
    TestExperiment experiment;
    experiment.dataset_hash = dataset->content_hash();
    experiment.methods = {{"SQP", 0}, {"SQP", 10}, {"Adam", 0}};
    for (int method = 0; method < 3; ++method) {
      for (const char* initialization : {"good", "in_collision"}) {
        experiment.results.push_back(
            {.method = method, .initialization = initialization, .problem = 0, .waypoints = {test::StandingUpright()}});
      }
    }
    WriteTestDatabase(folder_.path() / "DB", experiment);
    WriteTestDatabase(folder_.path() / "OTHER", experiment);
    // Without what distinguishes several runs of a method, exported methods have their plain names.
    Output({"export", "--db", "DB", "--dataset", "FOLDER", "--out", "SOLUTIONS"},
           {"--multi-starts", "0", "--initializations", "good"});
    Output({"export", "--db", "DB", "--dataset", "FOLDER", "--out", "BOTH"}, {});
  }

  ProgramResult RunFiltered(Words command, const Words& options) {
    for (std::string& word : command) {
      if (word == "FOLDER") word = data_.path().string();
    }
    command.insert(command.end(), options.begin(), options.end());
    return Run(command);
  }

  std::string Output(const Words& command, const Words& options) {
    const auto result = RunFiltered(command, options);
    EXPECT_EQ(result.exit_code, 0) << command.front() << ": " << result.err;
    return result.out;
  }

  TemporaryFolder data_;
};

const auto kNoCollision = AllOf(Not(HasSubstr("in_collision")), Not(HasSubstr("init in collision")));

TEST_F(FilterCommand, MethodsAreKeptByName) {
  for (const Reader& reader : kReaders) {
    for (const Words& option : {Words{"--methods", "Adam"}, Words{"--methods", "adam"}, Words{"--method", "Adam"}}) {
      EXPECT_THAT(Output(reader.command, option), AllOf(HasSubstr("Adam"), Not(HasSubstr("SQP"))));
    }
    EXPECT_THAT(Output(reader.command, {"--methods", "Adam,SQP"}), AllOf(HasSubstr("Adam"), HasSubstr("SQP")));
  }
}

TEST_F(FilterCommand, InitializationsAreKept) {
  for (const Reader& reader : kReaders) {
    EXPECT_THAT(Output(reader.command, {"--methods", "Adam", "--initializations", "good"}),
                AllOf(HasSubstr("Adam"), kNoCollision));
    EXPECT_THAT(Output(reader.command, {"--initialization", "good"}), kNoCollision);
  }
  EXPECT_THAT(Output({"evaluate", "BOTH", "--dataset", "FOLDER"}, {"--initializations", "good"}), kNoCollision);
}

TEST_F(FilterCommand, TasksOfTheExperimentChangeNothing) {
  for (const Reader& reader : kReaders) {
    EXPECT_EQ(Output(reader.command, {"--tasks", "posture"}), Output(reader.command, {})) << reader.command.front();
    EXPECT_EQ(Output(reader.command, {"--task", "posture"}), Output(reader.command, {})) << reader.command.front();
  }
}

TEST_F(FilterCommand, MethodsAreKeptByProperties) {
  for (const Reader& reader : kReaders) {
    if (!reader.has_properties) continue;
    EXPECT_THAT(Output(reader.command, {"--multi-starts", "10"}), AllOf(HasSubstr("SQP"), Not(HasSubstr("Adam"))));
    EXPECT_EQ(Output(reader.command, {"--multi-starts", "10"}),
              Output(reader.command, {"--methods", "SQP:multi_starts=10"}));
    EXPECT_EQ(Output(reader.command, {"--collision", "solid", "--sample-size", "100"}), Output(reader.command, {}));
  }
}

TEST_F(FilterCommand, RowsAreKeptByPosition) {
  for (const Reader& reader : kReaders) {
    if (!reader.has_rows) continue;
    const std::string first = Output(reader.command, {"--rows", "1"});
    EXPECT_THAT(first, AllOf(HasSubstr("SQP"), Not(HasSubstr("Adam")))) << reader.command.front();
    EXPECT_EQ(first, Output(reader.command, {"--rows", "1-1"}));
  }
  EXPECT_EQ(Output({"list", "--db", "DB"}, {"--rows", "2,4-5", "--format", "csv", "--columns", "job"}),
            "job\n2\n4\n5\n");
  EXPECT_EQ(Output({"table", "--db", "DB", "--rows", "2-3", "--format", "csv"}, {"--columns", "method,multi_starts"}),
            "method,multi_starts\nSQP,10\nAdam,0\n");
  EXPECT_EQ(Output({"query", "SELECT 7 AS x UNION SELECT 8", "--db", "DB"}, {"--rows", "2", "--format", "csv"}),
            "x\n8\n");
}

TEST_F(FilterCommand, ColumnsAreKeptByName) {
  for (const Words& command : {Words{"table", "--db", "DB"}, Words{"table", "--db", "DB", "--statistics"},
                               Words{"table", "--db", "DB", "--profile"}, Words{"list", "--db", "DB"},
                               Words{"evaluate", "SOLUTIONS", "--dataset", "FOLDER"}}) {
    const auto json = nlohmann::json::parse(Output(command, {"--columns", "method", "--format", "json"}));
    ASSERT_FALSE(json.empty()) << command.front();
    for (const auto& row : json) {
      EXPECT_EQ(row.size(), 1U) << command.front();
      EXPECT_TRUE(row.contains("method")) << command.front();
    }
    EXPECT_THAT(Output(command, {"--columns", "method", "--format", "csv"}), testing::StartsWith("method\n"));
    EXPECT_THAT(Output(command, {"--columns", "method"}), HasSubstr("Adam"));
  }
}

TEST_F(FilterCommand, ColumnsOfAComparisonAreThoseOfItsRows) {
  const Words command = {"compare", "DB", "OTHER", "--rows", "6"};
  EXPECT_EQ(Output(command, {"--columns", "task,initialization,change", "--format", "csv"}),
            "task,initialization,change\nposture,in_collision,none\n");
  EXPECT_THAT(Output(command, {"--columns", "initialization,change"}),
              AllOf(HasSubstr("in_collision"), HasSubstr("A: experiment 1"), Not(HasSubstr("posture"))));
}

TEST_F(FilterCommand, InterpolationKeepsRowsAndColumns) {
  TestExperiment motions;
  motions.task = "motion";
  motions.num_waypoints = 2;
  motions.methods = {{"SQP"}, {"Adam"}};
  motions.results = {{.method = 0}, {.method = 1}, {.method = 1, .initialization = "in_collision"}};
  WriteTestDatabase(folder_.path() / "motions", motions);
  const Words command = {"table", "--interpolation", "--db", "motions"};
  EXPECT_THAT(Output(command, {"--methods", "SQP"}), AllOf(HasSubstr("SQP"), Not(HasSubstr("Adam")), kNoCollision));
  EXPECT_THAT(Output(command, {"--rows", "2"}), AllOf(HasSubstr("Adam"), Not(HasSubstr("SQP"))));
  EXPECT_EQ(Output(command, {"--initializations", "in_collision", "--columns", "method,n", "--format", "csv"}),
            "method,n\nAdam,1\n");
}

TEST_F(FilterCommand, OneJobIsChosenByFilters) {
  const Words show = {"show", "--db", "DB", "--format", "json"};
  const Words adam = {"--methods", "Adam", "--initializations", "in_collision"};
  EXPECT_THAT(Output(show, adam), HasSubstr("\"method\": \"Adam\""));
  EXPECT_THAT(RunFiltered({"view", "--db", "DB", "--dataset", "FOLDER"}, adam).err, HasSubstr("job-6.html written"));
  ExpectError(RunFiltered(show, {"--methods", "Adam"}), 2,
              "there are several jobs of experiment 1 with --methods Adam: 5, 6; name one of them");
  ExpectError(RunFiltered(show, {"--methods", "Adam", "--problem", "7"}), 2,
              "there is no job of experiment 1 with --methods Adam --problem 7");
  ExpectError(RunFiltered({"show", "1", "--db", "DB"}, adam), 2, "name a job or choose one");
  ExpectError(RunFiltered({"view", "1", "--db", "DB"}, adam), 2, "name a job or choose one");
  ExpectError(RunFiltered({"replay", "1", "--db", "DB"}, adam), 2, "selects random jobs; give --random N");
}

TEST_F(FilterCommand, AReportSaysThatItIsAPart) {
  const auto result = RunFiltered(kOthers[0].command, {"--methods", "SQP", "--multi-starts", "10"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("Only a part of the results: --methods SQP --multi-starts 10"));
}

TEST_F(FilterCommand, AValueWithoutMatchesIsAnErrorInEveryCommand) {
  std::vector<Reader> all = kReaders;
  all.insert(all.end(), kOthers.begin(), kOthers.end());
  for (const Reader& reader : all) {
    SCOPED_TRACE(reader.command.front());
    ExpectError(RunFiltered(reader.command, {"--methods", "Adm"}), 2, "has no such method; did you mean 'Adam'?");
    ExpectError(RunFiltered(reader.command, {"--tasks", "motion"}), 2, "--tasks motion: ");
    ExpectError(RunFiltered(reader.command, {"--tasks", "motion"}), 2, "has no such task; valid: posture");
    ExpectError(RunFiltered(reader.command, {"--tasks", "moton"}), 2, "--tasks: 'moton' is not");
    ExpectError(RunFiltered(reader.command, {"--initializations", "god"}), 2, "did you mean 'good'");
    if (reader.has_properties) {
      ExpectError(RunFiltered(reader.command, {"--multi-starts", "7"}), 2, "has no such method; valid: 0, 10");
      ExpectError(RunFiltered(reader.command, {"--collision", "surface"}), 2, "--collision surface: ");
    }
    if (!reader.has_rows) continue;
    ExpectError(RunFiltered(reader.command, {"--rows", "99"}), 2, "--rows 99: the table has rows 1 to ");
    ExpectError(RunFiltered(reader.command, {"--rows", "some"}), 2, "give numbers and ranges, e.g. 1-3,5");
    ExpectError(RunFiltered(reader.command, {"--columns", "taks"}), 2, "--columns: there is no column 'taks'");
  }
}

TEST_F(FilterCommand, MethodsOfMethodsAreRefused) {
  ExpectError(Run({"compare", "SQP:multi_starts=0", "Adam", "--db", "DB", "--methods", "SQP"}), 2,
              "--methods SQP: A and B are methods");
}

// status, query: not by method. service: no results.
TEST_F(FilterCommand, EveryCommandThatReadsResultsHasTheFilters) {
  const std::set<std::string> without = {"status", "query"};
  std::istringstream help(Run({"--help"}).out);
  bool listed = false, any = false;
  for (std::string line; std::getline(help, line);) {
    if (line == "Experiments:") listed = true;
    std::istringstream words(line);
    std::string name;
    if (!listed || !line.starts_with("  ") || !(words >> name) || without.contains(name)) continue;
    const std::string options = Run({name, "--help"}).out;
    if (options.find("instead of asking the server") == std::string::npos) continue;
    any = true;
    EXPECT_THAT(options, AllOf(HasSubstr("--methods"), HasSubstr("--tasks"), HasSubstr("--initializations"))) << name;
  }
  EXPECT_TRUE(any);
}

}  // namespace
}  // namespace legopt::client
