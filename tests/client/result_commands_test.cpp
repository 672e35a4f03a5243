// Policy: commands that read results name errors in database, statement or id, and print the same content in every
// format.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "command_line_fixture.h"
#include "db/connection.h"
#include "legopt/planning/internal/trace.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;

using ResultCommands = CommandLine;

TEST_F(ResultCommands, MissingDatabase) {
  for (const char* command : {"table", "list", "status"}) {
    ExpectError(Run({command, "--db", "/nowhere/results.sqlite"}), 6, "/nowhere/results.sqlite");
  }
}

TEST_F(ResultCommands, ForeignDatabase) {
  const auto file =
      Write("text.sqlite", "this is not a database, but a long enough text to look like one at first sight\n");
  ExpectError(Run({"table", "--db", file}), 6, "text.sqlite");
}

TEST_F(ResultCommands, WrongSql) {
  const auto file = Database();
  ExpectError(Run({"query", "SELECT x FROM nowhere", "--db", file}), 2, "nowhere");
  ExpectError(Run({"query", "DELETE FROM jobs", "--db", file}), 2, "");
}

TEST_F(ResultCommands, EmptyOrMisspeltSqlIsTheUsersToMend) {
  const auto file = Database();
  for (const char* sql : {"", " ", ";"}) ExpectError(Run({"query", sql, "--db", file}), 2, "the SQL is empty");
  ExpectError(Run({"query", ""}), 2, "the SQL is empty");
  ExpectError(Run({"query", "SELECT * FROM joblist", "--db", file}), 2, "did you mean 'job_list'?");
}

TEST_F(ResultCommands, AQueryIsStoppedWhenItsTimeIsOver) {
  const std::string endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";
  ExpectError(Run({"query", endless, "--db", Database(), "--limit", "0.2"}), 16, "stopped after 0.2 s");
  ExpectError(Run({"query", "SELECT 1", "--limit", "0"}), 2, "--db");
}

// CSV and JSON of a file are written row by row. A limit that truncates the output is named and has its own exit code.
TEST_F(ResultCommands, AQueryIsWholeOrSaysWhatCutIt) {
  const auto file = Database();
  const std::string rows =
      "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 150000) SELECT i, zeroblob(i % 3) AS b "
      "FROM n";
  const auto csv = Run({"query", rows, "--db", file, "--format", "csv"});
  EXPECT_EQ(csv.exit_code, 0) << csv.err;
  EXPECT_EQ(std::count(csv.out.begin(), csv.out.end(), '\n'), 150'001);
  const auto json = Run({"query", rows, "--db", file, "--format", "json"});
  EXPECT_EQ(json.exit_code, 0) << json.err;
  EXPECT_EQ(nlohmann::json::parse(json.out).size(), 150'000U);
  for (const char* format : {"csv", "json", "text", "markdown"}) {
    const auto cut = Run({"query", "SELECT job_id FROM jobs", "--db", file, "--max-rows", "1", "--format", format});
    EXPECT_EQ(cut.exit_code, 16) << format;
    EXPECT_THAT(cut.err, HasSubstr("cut after 1 rows: --max-rows"));
  }
  const auto text = Run({"query", rows, "--db", file});
  EXPECT_EQ(text.exit_code, 16);
  EXPECT_THAT(text.err, HasSubstr("cut after 100000 rows"));
}

TEST_F(ResultCommands, AListThatALimitCutsSaysSo) {
  const auto file = Database();
  const auto cut = Run({"list", "1", "--db", file, "--limit", "1"});
  EXPECT_EQ(cut.exit_code, 16);
  EXPECT_THAT(cut.err, HasSubstr("only the first 1 jobs are shown: --limit; raise it"));
  const auto large = Run({"query", "SELECT hex(zeroblob(50000000)) AS x", "--db", file});
  ExpectError(large, 2, "at most 64 MiB");
  ExpectError(Run({"compare", "m\xfc", "SQP", "--db", file}), 2, "'m\\xfc' is no database file, no experiment");
}

TEST_F(ResultCommands, ATimeLimitLeavesJsonThatCanBeRead) {
  constexpr char kEndless[] =
      "SELECT 1 AS a UNION ALL SELECT count(*) FROM (WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
      "SELECT i FROM n)";
  const auto cut = Run({"query", kEndless, "--db", Database(), "--format", "json", "--limit", "0.2"});
  EXPECT_EQ(cut.exit_code, 16);
  EXPECT_THAT(cut.err, HasSubstr("stopped after 0.2 s"));
  EXPECT_EQ(nlohmann::json::parse(cut.out), nlohmann::json::parse(R"([{"a": 1}])"));
}

TEST_F(ResultCommands, InfinitiesAreNotNullAndColumnsAreNamedAlike) {
  const auto file = Database();
  const std::string sql = "SELECT 9e999 AS x, -9e999 AS x, NULL AS x, 1 AS x_2";
  EXPECT_EQ(Run({"query", sql, "--db", file, "--format", "csv"}).out, "x,x_3,x_4,x_2\ninf,-inf,,1\n");
  EXPECT_EQ(nlohmann::json::parse(Run({"query", sql, "--db", file, "--format", "json"}).out),
            nlohmann::json::parse(R"([{"x": "inf", "x_3": "-inf", "x_4": null, "x_2": 1}])"));
  EXPECT_THAT(Run({"query", sql, "--db", file}).out, HasSubstr("inf"));
  EXPECT_EQ(Run({"query", sql, "--db", file, "--format", "csv", "--columns", "x_2,x_3"}).out, "x_2,x_3\n1,-inf\n");
}

TEST_F(ResultCommands, ABackupIsMadeAndRestored) {
  const auto file = Database();
  const std::string copy = file + ".copy";
  EXPECT_EQ(Run({"service", "backup", file, copy}).exit_code, 0);
  ExpectError(Run({"service", "backup", file, copy}), 6, "not overwritten");
  ExpectError(Run({"service", "backup", file}), 2, "legopt service backup DATABASE COPY");
  ExpectError(Run({"service", "backup", "--db", file, copy, copy}), 2, "legopt service backup --db DATABASE COPY");
  const auto restored = Run({"service", "restore", copy, "--db", file});
  EXPECT_EQ(restored.exit_code, 0) << restored.err;
  EXPECT_THAT(restored.out, HasSubstr("The former file is " + file + ".replaced-"));
  EXPECT_EQ(Run({"table", "--db", file}).exit_code, 0);
  ExpectError(Run({"service", "restore", "/nowhere/copy", "--db", file}), 6, "/nowhere/copy");
}

TEST_F(ResultCommands, ListOfWhatIsNotThereSaysWhatIs) {
  const auto file = Database();
  ExpectError(Run({"list", "--db", file, "--method", "SQQ"}), 2, "did you mean 'SQP'");
  ExpectError(Run({"list", "--db", file, "--verdict", "foot_pos"}), 2, "did you mean 'foot_pose'");
  ExpectError(Run({"list", "--db", file, "--problem", "9999"}), 2, "has no such problem; it has posture 0 to 1");
  ExpectError(Run({"list", "--db", file, "--multi-starts", "7"}), 2, "--multi-starts 7");
}

TEST_F(ResultCommands, AnAlteredDatabaseIsTheUsersFileAndUnusable) {
  const auto file = Database();
  {
    db::Connection connection(file, db::Connection::Mode::kReadWriteCreate);
    connection.Execute("DROP TABLE waypoints");
  }
  ExpectError(Run({"table", "--db", file}), 6, "table 'waypoints' is missing; restore a backup");
  const auto doctor = Run({"service", "doctor", "--db", file});
  EXPECT_NE(doctor.exit_code, 0);
  EXPECT_THAT(doctor.out, HasSubstr("missing or changed: table 'waypoints'"));
  EXPECT_THAT(doctor.out + doctor.err, testing::Not(HasSubstr("legopt-audit")));
}

TEST_F(ResultCommands, UnknownIds) {
  const auto file = Database();
  ExpectError(Run({"table", "9", "--db", file}), 2, "no experiment 9");
  ExpectError(Run({"show", "99", "--db", file}), 2, "no job 99");
}

TEST_F(ResultCommands, TableInEveryFormat) {
  const auto file = Database();
  for (const char* format : {"text", "markdown", "latex", "csv", "json"}) {
    const auto result = Run({"table", "--db", file, "--format", format});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("SQP")) << format;
  }
  EXPECT_THAT(Run({"table", "1", "--db", file}).out, HasSubstr("1/2"));
}

TEST_F(ResultCommands, ListingsHaveJson) {
  const auto file = Database();
  EXPECT_EQ(nlohmann::json::parse(Run({"list", "--db", file, "--format", "json"}).out).size(), 2U);
  EXPECT_EQ(nlohmann::json::parse(Run({"list", "--db", file, "--unsolved", "--format", "json"}).out).size(), 1U);
  EXPECT_EQ(nlohmann::json::parse(Run({"list", "--db", file, "--state", "dead", "--format", "json"}).out).size(), 0U);
  const auto status = nlohmann::json::parse(Run({"status", "--db", file, "--format", "json"}).out)[0];
  EXPECT_EQ(status.at("solved"), 1);
  EXPECT_EQ(status.at("methods"), "SQP");
  EXPECT_EQ(status.at("dataset"), "tiny");
  const auto job = nlohmann::json::parse(Run({"show", "2", "--db", file, "--format", "json"}).out);
  EXPECT_EQ(job.at("result").at("verdict_literal"), "com");
  EXPECT_EQ(job.at("attempt_list").size(), 1U);
  EXPECT_EQ(nlohmann::json::parse(Run({"query", "SELECT 1 AS one", "--db", file, "--format", "json"}).out)[0].at("one"),
            1);
}

TEST_F(ResultCommands, ShowTellsResultAndAttempts) {
  const auto result = Run({"show", "2", "--db", Database()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("com"), HasSubstr("finished"), HasSubstr("worker-1")));
}

class TraceCommand : public CommandLine {
 protected:
  // Creates three jobs: with a trace, without one, queued.
  std::string Traced() {
    const auto file = folder_.path() / "traced.sqlite";
    const std::vector<IterationRecord> records = {{.step = 0,
                                                   .penalty = 100,
                                                   .trust_box = 0.1,
                                                   .cost = 401.25,
                                                   .violation = 0.5,
                                                   .evaluations = 10,
                                                   .elapsed_us = 70},
                                                  {.step = 4,
                                                   .penalty = 1000,
                                                   .trust_box = 0.2,
                                                   .cost = 1.0 / 3,
                                                   .violation = 1e-5,
                                                   .accepted = true,
                                                   .evaluations = 40,
                                                   .elapsed_us = 300}};
    TestExperiment experiment;
    experiment.results = {
        {.problem = 0, .trace = EncodeTrace(records)}, {.problem = 1}, {.problem = 2, .finished = false}};
    WriteTestDatabase(file, experiment);
    return file.string();
  }
};

TEST_F(TraceCommand, PrintsAndExportsEveryRecord) {
  const std::string file = Traced();
  const std::string csv = Run({"show", "1", "--trace", "--db", file, "--format", "csv"}).out;
  EXPECT_EQ(csv.substr(0, csv.find('\n')),
            "step,window,restart,start,penalty,trust_box,accepted,evaluations,elapsed_us,cost,violation");
  const auto json = nlohmann::json::parse(Run({"show", "1", "--trace", "--db", file, "--format", "json"}).out);
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0].at("accepted"), 0);
  EXPECT_EQ(json[1].at("step"), 4);
  EXPECT_EQ(json[1].at("cost"), 1.0 / 3) << "bit by bit";
  EXPECT_EQ(json[1].at("elapsed_us"), 300);
  EXPECT_THAT(Run({"show", "1", "--trace", "--db", file}).out, AllOf(HasSubstr("401.25"), HasSubstr("evaluations")));
  const std::string out = (folder_.path() / "trace.csv").string();
  const auto written = Run({"show", "1", "--trace", "--db", file, "--format", "csv", "--out", out});
  EXPECT_EQ(written.exit_code, 0) << written.err;
  EXPECT_EQ(written.out, "");
  std::ifstream stream(out, std::ios::binary);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(stream), {}), csv);
}

TEST_F(TraceCommand, SaysWhyThereIsNone) {
  const std::string file = Traced();
  ExpectError(Run({"show", "9", "--trace", "--db", file}), 2, "job 9 does not exist; 'legopt list --db");
  ExpectError(Run({"show", "3", "--trace", "--db", file}), 2, "job 3 is queued and has no result; 'legopt show 3 --db");
  ExpectError(Run({"show", "2", "--trace", "--db", file}), 2, "job 2 has a result without a trace");
  ExpectError(Run({"show", "1", "--trace", "--db", file, "--out", "/nowhere/x.csv"}), 2, "/nowhere/x.csv");
}

TEST_F(TraceCommand, DamageIsTheDatabases) {
  const std::string file = Traced();
  {
    db::Connection connection(file, db::Connection::Mode::kReadWriteCreate);
    const std::string trigger = connection.QueryText("SELECT sql FROM sqlite_schema WHERE name = 'results_are_final'");
    connection.Execute("DROP TRIGGER results_are_final; UPDATE results SET trace = x'5a5a5a5a5a5a' WHERE job_id = 1");
    connection.Execute(trigger);
  }
  ExpectError(Run({"show", "1", "--trace", "--db", file}), 6, "job 1: trace");
}

// An upgraded database of a release without traces.
TEST_F(TraceCommand, OlderResultsShowTheHistoryThatTheyHave) {
  const std::string file = Traced();
  {
    db::Connection connection(file, db::Connection::Mode::kReadWriteCreate);
    const std::string trigger = connection.QueryText("SELECT sql FROM sqlite_schema WHERE name = 'results_are_final'");
    connection.Execute(
        "DROP TRIGGER results_are_final; UPDATE results SET trace = NULL, history_json = "
        "'{\"columns\":[\"penalty\",\"steps\",\"violation\"],\"rows\":[[100,7,0.25],[1000,2,1e-5]]}' WHERE job_id = 1");
    connection.Execute(trigger);
  }
  const auto result = Run({"show", "1", "--trace", "--db", file, "--format", "json"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("older than traces"));
  const auto json = nlohmann::json::parse(result.out);
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0].at("steps"), 7);
  EXPECT_EQ(json[1].at("violation"), 1e-5);
}

TEST_F(ResultCommands, ExportNeedsTheSameDataset) {
  ExpectError(Run({"export", "--db", Database(), "--out", "out.json"}), 5, "--dataset");
}

}  // namespace
}  // namespace legopt::client
