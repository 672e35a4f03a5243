// Policy: every fault is one line "legopt: error: ..." with its own exit code; results are printed on standard output
// and nothing else is.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "db/connection.h"
#include "program_run.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class CommandLine : public testing::Test {
 protected:
  ProgramResult Run(const std::vector<std::string>& arguments,
                    const std::map<std::string, std::string>& environment = {}) {
    return RunLegopt(arguments, folder_.path(), environment);
  }

  std::string Write(const std::string& name, const std::string& text) {
    const auto file = folder_.path() / name;
    std::ofstream(file) << text;
    return file.string();
  }

  // One line, with the program's name.
  void ExpectError(const ProgramResult& result, int code, const std::string& words) {
    EXPECT_EQ(result.exit_code, code) << result.err;
    EXPECT_THAT(result.err, AllOf(StartsWith("legopt: error: "), HasSubstr(words)));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_EQ(result.out, "");
  }

  std::string Database() {
    const auto file = folder_.path() / "test.sqlite";
    TestExperiment experiment;
    experiment.results = {{.problem = 0}, {.problem = 1, .verdict = "com"}};
    WriteTestDatabase(file, experiment);
    return file.string();
  }

  TemporaryFolder folder_;
};

TEST_F(CommandLine, HelpNamesCommandsAndExitCodes) {
  const auto result = Run({"--help"});
  EXPECT_EQ(result.exit_code, 0);
  for (const char* word : {"run",     "submit",   "watch",      "status",     "list",
                           "show",    "cancel",   "pause",      "resume",     "hold",
                           "release", "priority", "retry",      "rename",     "tag",
                           "delete",  "table",    "query",      "evaluate",   "export",
                           "doctor",  "dataset",  "tap",        "Exit codes", "database unusable",
                           "help",    "version",  "LEGOPT_DATA"}) {
    EXPECT_THAT(result.out, HasSubstr(word));
  }
}

TEST_F(CommandLine, VersionIsPrinted) { EXPECT_THAT(Run({"--version"}).out, StartsWith("legopt ")); }

TEST_F(CommandLine, WrongUsage) {
  ExpectError(Run({"tabel"}), 2, "did you mean 'table'?");
  ExpectError(Run({"table", "--format", "jsn"}), 2, "did you mean 'json'?");
  ExpectError(Run({"table", "--nonsense"}), 2, "--nonsense");
  ExpectError(Run({"table", "--rule", "loose"}), 2, "loose");
  ExpectError(Run({"cancel"}), 2, "ID");
  ExpectError(Run({"hold", "1"}), 2, "REASON");
  ExpectError(Run({"priority", "1", "1001"}), 2, "1001");
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
      {"rm", "delete"},     {"ls", "list"},   {"kill", "cancel"}, {"stop", "cancel"},
      {"eval", "evaluate"}, {"ps", "status"}, {"sql", "query"}};
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
  ExpectError(Run({"hold", "1", ""}), 2, "REASON: is empty");
  ExpectError(Run({"hold", "1", std::string(1001, 'x')}), 2, "REASON: is 1001 bytes long; at most 1000");
}

TEST_F(CommandLine, SuiteThatIsAFolder) {
  std::filesystem::create_directory(folder_.path() / "suite.yaml");
  for (const char* name : {"suite.yaml", "./suite.yaml"}) {
    ExpectError(Run({"submit", name}), 2, std::string("'") + name + "' is a folder, not an experiment file");
  }
}

TEST_F(CommandLine, DryRunChecksWhatTheServerWould) {
  const auto suite =
      Write("long.yaml", "name: " + std::string(5000, 'n') + "\ntasks: posture\nmethods: [{solver: sqp}]\n");
  for (const char* command : {"submit", "run"}) {
    ExpectError(Run({command, "--dry-run", suite}), 2, "long.yaml:1: name: is 5000 bytes long, at most 200");
  }
}

TEST_F(CommandLine, NamesOfFilesAreCheckedLikeThoseInThem) {
  const std::string text = "tasks: posture\nmethods: [{solver: sqp}]\n";
  ExpectError(Run({"submit", "--dry-run", Write("\xff.yaml", text)}), 2, "name: must be UTF-8 of 1 to 200 bytes");
  ExpectError(Run({"submit", "--dry-run", Write(std::string(220, 'n') + ".yaml", text)}), 2, "200 bytes, it has 220");
}

TEST_F(CommandLine, DryRunTellsWhatIsLeftOut) {
  const auto result = Run({"submit", "--dry-run", "quick", "--problems", "0-5"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("left out: no motion is left: all 6 chosen problems are longer than 50 stances"));
  EXPECT_THAT(result.err, StartsWith("legopt: warning: no motion is left"));
  const auto usual = Run({"submit", "--dry-run", "quick"});
  EXPECT_THAT(usual.out, HasSubstr("motion problems are longer than 50 stances"));
  EXPECT_EQ(usual.err, "") << "as the suite says";
}

TEST_F(CommandLine, RunHasADryRun) {
  const auto result = Run({"run", "--dry-run", "quick", "--workers", "3", "--db", "my.sqlite"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("540 jobs: "), HasSubstr("at most "), HasSubstr("with 3 workers"),
                                HasSubstr("legopt-server --db my.sqlite (new)"), HasSubstr("legopt-worker --slots 3"),
                                HasSubstr("nothing was started")));
  EXPECT_TRUE(std::filesystem::is_empty(folder_.path()));
  const auto json = Run({"run", "--dry-run", "quick", "--format", "json"});
  EXPECT_EQ(nlohmann::json::parse(json.out).at("jobs"), 540);
}

TEST_F(CommandLine, SuitesAreNarrowedByMethodFigures) {
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

// Every command that prints much or little, into a device that is always full.
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
                                             "doctor"};
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
  const auto result = Run({"doctor"});
  EXPECT_THAT(result.out, HasSubstr("embedded suites and datasets in "));
  EXPECT_THAT(Run({"doctor"}, {{"LEGOPT_DATA", "/nowhere"}}).out, HasSubstr("/nowhere"));
  EXPECT_THAT(Run({"--help"}, {{"LEGOPT_DATA", "/nowhere"}}).out, HasSubstr("/nowhere"));
}

TEST_F(CommandLine, OutOfMemoryIsNoDefect) {
  constexpr std::size_t kFileBytes = std::size_t{80} << 20;
  const auto suite = Write("huge.yaml", "name: " + std::string(kFileBytes, 'x') + "\n");
  const auto result =
      RunningProgram("/bin/sh",
                     {"-c", "ulimit -v 450000; exec " + BuiltProgram("legopt").string() + " submit --dry-run " + suite},
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

TEST_F(CommandLine, UnknownSuiteNamesTheEmbeddedOnes) {
  ExpectError(Run({"submit", "--dry-run", "quikc"}), 2, "quick");
}

TEST_F(CommandLine, UnknownSuiteKey) {
  const auto suite = Write("bad.yaml", "tasks: posture\nmethdos: []\n");
  for (const char* command : {"run", "submit"})
    ExpectError(Run({command, suite}), 2, "bad.yaml:2: methdos: unknown key");
}

TEST_F(CommandLine, MissingDataset) {
  const auto suite = Write("suite.yaml", "tasks: posture\nmethods: [{solver: sqp}]\n");
  ExpectError(Run({"submit", "--dry-run", suite, "--dataset", "/nowhere/data"}), 2, "/nowhere/data");
  ExpectError(Run({"submit", "--dry-run", suite}, {{"LEGOPT_DATA", "/nowhere/data"}}), 2, "LEGOPT_DATA");
}

TEST_F(CommandLine, DryRunCountsAndSubmitsNothing) {
  const auto result = Run({"submit", "--dry-run", "quick", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_GT(json.at("jobs").get<int>(), 0);
  EXPECT_EQ(json.at("spec").at("spec_version"), 1);
  EXPECT_EQ(json.at("submission_id").get<std::string>().size(), 32U);
}

TEST_F(CommandLine, ListsDoNotSwallowTheSuite) {
  const auto result =
      Run({"submit", "--dry-run", "--problems", "0-2,5", "--initializations", "good", "quick", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(nlohmann::json::parse(result.out).at("spec").at("tasks")[0].at("problems"), (nlohmann::json{0, 1, 2, 5}));
}

TEST_F(CommandLine, MissingDatabase) {
  for (const char* command : {"table", "list", "status"}) {
    ExpectError(Run({command, "--db", "/nowhere/results.sqlite"}), 6, "/nowhere/results.sqlite");
  }
}

TEST_F(CommandLine, ForeignDatabase) {
  const auto file =
      Write("text.sqlite", "this is not a database, but a long enough text to look like one at first sight\n");
  ExpectError(Run({"table", "--db", file}), 6, "text.sqlite");
}

TEST_F(CommandLine, WrongSql) {
  const auto file = Database();
  ExpectError(Run({"query", "SELECT x FROM nowhere", "--db", file}), 2, "nowhere");
  ExpectError(Run({"query", "DELETE FROM jobs", "--db", file}), 2, "");
}

TEST_F(CommandLine, EmptyOrMisspeltSqlIsTheUsersToMend) {
  const auto file = Database();
  for (const char* sql : {"", " ", ";"}) ExpectError(Run({"query", sql, "--db", file}), 2, "the SQL is empty");
  ExpectError(Run({"query", ""}), 2, "the SQL is empty");
  ExpectError(Run({"query", "SELECT * FROM joblist", "--db", file}), 2, "did you mean 'job_list'?");
}

TEST_F(CommandLine, AQueryIsStoppedWhenItsTimeIsOver) {
  const std::string endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n";
  ExpectError(Run({"query", endless, "--db", Database(), "--limit", "0.2"}), 3, "stopped after 0.2 s");
  ExpectError(Run({"query", "SELECT 1", "--limit", "0"}), 2, "--db");
}

TEST_F(CommandLine, ListOfWhatIsNotThereSaysWhatIs) {
  const auto file = Database();
  ExpectError(Run({"list", "--db", file, "--method", "SQQ"}), 2, "did you mean 'SQP'");
  ExpectError(Run({"list", "--db", file, "--verdict", "foot_pos"}), 2, "did you mean 'foot_pose'");
  ExpectError(Run({"list", "--db", file, "--problem", "9999"}), 2, "has no such problem; it has posture 0 to 1");
  ExpectError(Run({"list", "--db", file, "--multi-starts", "7"}), 2, "--multi-starts 7");
}

TEST_F(CommandLine, AnAlteredDatabaseIsTheUsersFileAndUnusable) {
  const auto file = Database();
  {
    db::Connection connection(file, db::Connection::Mode::kReadWriteCreate);
    connection.Execute("DROP TABLE waypoints");
  }
  ExpectError(Run({"table", "--db", file}), 6, "table 'waypoints' is missing; restore a backup");
  const auto doctor = Run({"doctor", "--db", file});
  EXPECT_NE(doctor.exit_code, 0);
  EXPECT_THAT(doctor.out, HasSubstr("missing or changed: table waypoints"));
  EXPECT_THAT(doctor.out + doctor.err, testing::Not(HasSubstr("legopt-audit")));
}

TEST_F(CommandLine, UnknownIds) {
  const auto file = Database();
  ExpectError(Run({"table", "9", "--db", file}), 2, "no experiment 9");
  ExpectError(Run({"show", "99", "--db", file}), 2, "no job 99");
}

TEST_F(CommandLine, TableInEveryFormat) {
  const auto file = Database();
  for (const char* format : {"text", "markdown", "latex", "csv", "json"}) {
    const auto result = Run({"table", "--db", file, "--format", format});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("SQP")) << format;
  }
  EXPECT_THAT(Run({"table", "1", "--db", file}).out, HasSubstr("1/2"));
}

TEST_F(CommandLine, ListingsHaveJson) {
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

TEST_F(CommandLine, ShowTellsResultAndAttempts) {
  const auto result = Run({"show", "2", "--db", Database()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, AllOf(HasSubstr("com"), HasSubstr("finished"), HasSubstr("worker-1")));
}

TEST_F(CommandLine, BadSolutionFile) {
  ExpectError(Run({"evaluate", "/nowhere/solutions.json"}), 2, "/nowhere/solutions.json");
  ExpectError(Run({"evaluate", Write("broken.json", "{\"problems\": [")}), 2, "broken.json");
}

// The embedded posture solutions, with one number of problem 3 replaced.
TEST_F(CommandLine, EvaluateJudgesTheOthersWhenANumberCannotBeRead) {
  std::ifstream stream(std::filesystem::path(LEGOPT_SOURCE_DIR) / "data/garage-easier/solutions-posture.json");
  auto json = nlohmann::json::parse(stream);
  json["problems"][3]["solution"][0]["x"][0] = "0.1\n1e400";
  const auto result = Run({"evaluate", Write("bad.json", json.dump()), "--format", "json"});
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("1 of 50 solutions have numbers that cannot be read"));
  EXPECT_THAT(result.err, HasSubstr("bad.json: problem 3, SQP(Multistart10), waypoint 0: number 1 is '1e400'"));
  const auto report = nlohmann::json::parse(result.out);
  EXPECT_EQ(report.at("methods")[0].at("solved"), 49);
  EXPECT_EQ(report.at("methods")[0].at("problems"), 50);
  EXPECT_EQ(report.at("differing_definitions").size(), 0U);
}

TEST_F(CommandLine, ExportNeedsTheSameDataset) {
  ExpectError(Run({"export", "--db", Database(), "--out", "out.json"}), 5, "--dataset");
}

TEST_F(CommandLine, DatasetInfoAndHashCheck) {
  const auto folder = std::filesystem::path(LEGOPT_SOURCE_DIR) / "data" / "garage-small";
  const auto info = Run({"dataset", "info", folder.string(), "--format", "json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  EXPECT_EQ(nlohmann::json::parse(info.out)[0].at("hash").get<std::string>().size(), 64U);
  EXPECT_EQ(Run({"dataset", "hash", folder.string(), "--check"}).exit_code, 0);
}

TEST_F(CommandLine, DatasetInfoHasTheJointsInTheOrderOfSolutions) {
  const auto folder = (std::filesystem::path(LEGOPT_SOURCE_DIR) / "data" / "garage-small").string();
  const auto joints = nlohmann::json::parse(Run({"dataset", "info", folder, "--format", "json"}).out)[0].at("joints");
  ASSERT_EQ(joints.size(), 29U);
  EXPECT_EQ(joints[0], (nlohmann::json{{"index", 0},
                                       {"joint", "back_lbz"},
                                       {"type", "revolute"},
                                       {"lower", joints[0].at("lower")},
                                       {"upper", joints[0].at("upper")},
                                       {"unit", "rad"}}));
  EXPECT_LT(joints[0].at("lower").get<double>(), joints[0].at("upper").get<double>());
  EXPECT_EQ(joints[10].at("joint"), "hokuyo_joint");
  EXPECT_TRUE(joints[10].at("lower").is_null());
  const auto text = Run({"dataset", "info", folder});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("back_lbz"), HasSubstr("continuous"),
                              HasSubstr("position x y z (29-31, m), quaternion w x y z (32-35)")));
}

TEST_F(CommandLine, DatasetHashFindsAndMendsAChange) {
  const auto copy = folder_.path() / "copy";
  std::filesystem::copy(std::filesystem::path(LEGOPT_SOURCE_DIR) / "data" / "garage-small", copy,
                        std::filesystem::copy_options::recursive);
  std::ofstream(copy / "scene.yaml", std::ios::app) << "# one more line\n";
  const auto check = Run({"dataset", "hash", copy.string(), "--check"});
  EXPECT_EQ(check.exit_code, 5);
  EXPECT_THAT(check.out, HasSubstr("differs"));
  EXPECT_EQ(Run({"dataset", "info", copy.string()}).exit_code, 2);
  EXPECT_EQ(Run({"dataset", "hash", copy.string()}).exit_code, 0);
  EXPECT_EQ(Run({"dataset", "hash", copy.string(), "--check"}).exit_code, 0);
  EXPECT_EQ(Run({"dataset", "info", copy.string()}).exit_code, 0);
}

// Commands that talk to a server, without one, on ports that nobody uses.
class WithoutServer : public CommandLine {
 protected:
  void SetUp() override {
    try {
      port_ = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
    } catch (const bus::BusError& error) {
      GTEST_SKIP() << error.what();
    }
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
  }
  std::string port_;
};

TEST_F(WithoutServer, EveryCommandSaysSo) {
  const std::vector<std::vector<std::string>> commands = {
      {"status"},         {"list"}, {"table"}, {"watch"}, {"show", "1"}, {"cancel", "1"}, {"query", "SELECT 1"},
      {"submit", "quick"}};
  for (auto command : commands) {
    command.insert(command.end(), {"--port", port_, "--timeout", "0.2"});
    ExpectError(Run(command), 3, "no legopt-server answers at 239.255.76.67:" + port_);
  }
}

// What is most likely stands first: with a key, that it is not the server's.
TEST_F(WithoutServer, AKeyIsSuspectedFirst) {
  ASSERT_EQ(Run({"keygen", "lab.key"}).exit_code, 0);
  const auto key = (folder_.path() / "lab.key").string();
  ExpectError(Run({"status", "--port", port_, "--timeout", "0.2", "--key-file", key}), 3,
              ":" + port_ + "; does it have the same key as we have in " + key + "? Else start one");
  ExpectError(Run({"status", "--port", port_, "--timeout", "0.2"}, {{"LEGOPT_KEY_FILE", ""}}), 3,
              "A server that has a key answers only who has it");
}

TEST_F(WithoutServer, PortMayComeFromTheEnvironment) {
  ExpectError(Run({"status", "--timeout", "0.2"}, {{"LEGOPT_PORT", port_}}), 3, port_);
}

TEST_F(WithoutServer, BadAddressIsAUsageError) {
  ExpectError(Run({"status", "--group", "10.0.0.1"}), 2, "10.0.0.1");
  ExpectError(Run({"status", "--port", "99"}), 2, "99");
}

TEST_F(WithoutServer, DoctorWarnsButDoesNotFail) {
  const auto result = Run({"doctor", "--port", port_, "--timeout", "0.2", "--format", "json"});
  const auto findings = nlohmann::json::parse(result.out);
  bool server_seen = false;
  for (const auto& finding : findings) {
    if (finding.at("check") == "server") {
      server_seen = true;
      EXPECT_EQ(finding.at("state"), "warn");
      EXPECT_NE(finding.at("fix"), "");
    }
    const bool must_be_ok = finding.at("check") == "dataset" || finding.at("check") == "multicast route";
    EXPECT_TRUE(!must_be_ok || finding.at("state") == "ok") << finding;
  }
  EXPECT_TRUE(server_seen);
}

TEST_F(WithoutServer, DoctorFailsForABadDataset) {
  const auto result = Run({"doctor", "--port", port_, "--timeout", "0.2", "--dataset", "/nowhere"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("fail"));
}

}  // namespace
}  // namespace legopt::client
