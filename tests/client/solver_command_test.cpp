// Policy: an external solver is a row of the table and judged like all others. Its errors cost one attempt of their
// job, with a reason, leave nothing behind, and do not affect other jobs. docs/reference/external-solvers.md documents
// the behaviour.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "app/exit_codes.h"
#include "program_run.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using app::ExitCode;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// Common preamble of the misbehaving solvers below.
constexpr char kSolverPreamble[] = R"(import json, subprocess, sys, time
def say(message): print(json.dumps(message), flush=True)
def hello(): say({'type': 'hello', 'protocol': 1, 'name': 'bad', 'version': '1'})
def solve(): return json.loads(sys.stdin.readline())
)";

struct Misdeed {
  const char* name;
  const char* code;
  const char* reason;
};

constexpr Misdeed kMisdeeds[] = {
    {"mute", "time.sleep(600)", "did not say hello within 1.0 s"},
    {"silent", "hello(); time.sleep(600)", "sent nothing for 1.0 s"},
    {"endless",
     "hello(); p = solve()\n"
     "while True:\n"
     "  say({'type': 'evaluate', 'id': 1, 'x': [0.0] * p['variables'], 'gradients': False}); solve()",
     "asked for the same point 1000 times in a row"},
    {"garbage", "hello(); solve(); print('Traceback', flush=True); time.sleep(600)", "no JSON object"},
    {"wrong_size", "hello(); solve(); say({'type': 'solution', 'x': [0.0], 'status': 'limit'}); time.sleep(600)",
     "with 1 numbers in 'x' where the program has"},
    {"forks",
     "hello(); solve()\n"
     "for _ in range(20): subprocess.Popen(['sleep', '86397'], start_new_session=True)\n"
     "sys.exit('children are left')",
     "ended with exit code 1; its last words: children are left"},
    {"fills_memory", "hello(); solve(); x = []\nwhile True: x.append(bytearray(1 << 24))", "MemoryError"},
    {"writes",
     "hello(); solve(); f = open('out', 'wb')\n"
     "for _ in range(64): f.write(bytes(1 << 24))",
     "File too large"},
};

// Common preamble of the misbehaving solvers of level "files".
constexpr char kFileSolverPreamble[] = R"(import json, os, subprocess, sys, time
problem = json.load(open(sys.argv[1]))
def leave(solution): open(sys.argv[2], 'w').write(solution if isinstance(solution, str) else json.dumps(solution))
)";

constexpr Misdeed kFileMisdeeds[] = {
    {"silent", "time.sleep(600)", "sent nothing for 1.0 s"},
    {"empty", "pass", "ended without a solution file"},
    {"folder", "os.mkdir(sys.argv[2])", "ended without a solution file"},
    {"garbage", "leave('Traceback')", "left a solution file that is no JSON object"},
    {"wrong_size", "leave({'x': [0.0]})", "with 1 numbers in 'x' where the program has"},
    {"wrong_waypoints", "leave({'waypoints': [[0.0]]})", "sent other 'waypoints' than 1 of"},
    {"unknown_status", "leave({'x': [0.0] * problem['variables'], 'status': 'fine'})",
     "one of converged, limit, failed"},
    {"gives_up", "leave({'x': [0.0] * problem['variables']}); sys.exit('no way')",
     "ended with exit code 1; its last words: no way"},
    {"forks",
     "for _ in range(20): subprocess.Popen(['sleep', '86396'], start_new_session=True)\n"
     "sys.exit(3)",
     "ended with exit code 3"},
    {"fills_memory", "x = []\nwhile True: x.append(bytearray(1 << 24))", "MemoryError"},
    {"writes",
     "f = open(sys.argv[2], 'wb')\n"
     "for _ in range(64): f.write(bytes(1 << 24))",
     "File too large"},
};

class SolverCommand : public testing::Test {
 protected:
  void Declare(const std::string& name, const std::string& code, double timeout_s = 1.0) const {
    test::WriteText(folder_.path() / (name + ".py"), kSolverPreamble + code + "\n");
    const nlohmann::json declaration = {
        {"name", name}, {"command", {"/usr/bin/python3", name + ".py"}}, {"timeout_s", timeout_s}};
    test::WriteText(folder_.path() / (name + ".json"), declaration.dump());
  }
  // Declares a solver of level "files".
  void DeclareFiles(const std::string& name, const std::string& code, double timeout_s = 60.0) const {
    test::WriteText(folder_.path() / (name + ".py"), kFileSolverPreamble + code + "\n");
    const nlohmann::json declaration = {
        {"name", name}, {"level", "files"}, {"command", {"/usr/bin/python3", name + ".py"}}, {"timeout_s", timeout_s}};
    test::WriteText(folder_.path() / (name + ".json"), declaration.dump());
  }
  ProgramResult Run(const std::vector<std::string>& words) const { return RunLegopt(words, folder_.path()); }
  // Returns the reason of every job's only attempt, by method.
  std::map<std::string, std::string> Reasons(const std::string& database) const {
    const std::string sql =
        "SELECT m.name, a.message FROM attempts AS a JOIN jobs AS j USING (job_id) JOIN cells AS c USING (cell_id) "
        "JOIN "
        "methods AS m USING (method_id)";
    const ProgramResult listed = Run({"query", sql, "--db", database, "--format", "json"});
    std::map<std::string, std::string> reasons;
    for (const nlohmann::json& row : nlohmann::json::parse(listed.out)) reasons[row.at("name")] = row.at("message");
    return reasons;
  }

  // Runs all of them on posture 0. Each must cost its attempt for the expected reason.
  void ExpectReasons(std::span<const Misdeed> misdeeds) const;

  test::TemporaryFolder folder_;
};

void SolverCommand::ExpectReasons(std::span<const Misdeed> misdeeds) const {
  std::string methods = "  - {solver: sqp}\n";
  std::vector<std::string> words = {"run", "bad.yaml", "--db", "bad.sqlite"};
  for (const Misdeed& misdeed : misdeeds) {
    methods += std::string("  - {solver: ") + misdeed.name + "}\n";
    words.insert(words.end(), {"--solver", std::string(misdeed.name) + ".json"});
  }
  test::WriteText(folder_.path() / "bad.yaml",
                  "tasks: [{task: posture, problems: [0]}]\ninitializations: [good]\nmax_attempts: 1\nmethods:\n" +
                      methods + "limits: {memory_mb: 256}\n");
  const ProgramResult result = Run(words);
  EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kJobsFailed)) << result.err;
  auto reasons = Reasons("bad.sqlite");
  for (const Misdeed& misdeed : misdeeds) {
    EXPECT_THAT(reasons[std::string(misdeed.name) + " (external)"],
                AllOf(HasSubstr("solver '" + std::string(misdeed.name) + "' (external) "), HasSubstr(misdeed.reason)));
  }
  EXPECT_EQ(reasons["SQP"], "");
}

TEST_F(SolverCommand, MisdeedsCostAnAttemptHaveAReasonAndLeaveNothing) {
  for (const Misdeed& misdeed : kMisdeeds) {
    constexpr double kShort_s = 1.0, kLong_s = 30.0;  // on busy processors, a solver may need seconds to fail
    const bool waits = std::string(misdeed.reason).find("1.0 s") != std::string::npos;
    Declare(misdeed.name, misdeed.code, waits ? kShort_s : kLong_s);
  }
  ExpectReasons(kMisdeeds);
  EXPECT_NE(std::system("pgrep -f '^sleep 86397$' >/dev/null"), 0) << "processes of a solver are left";
  EXPECT_LE(std::filesystem::file_size(folder_.path() / "out"), std::uintmax_t{64} << 20);
}

TEST_F(SolverCommand, MisdeedsWithFilesCostAnAttemptHaveAReasonAndLeaveNothing) {
  const std::filesystem::path scratch = folder_.path() / "scratch";
  std::filesystem::create_directory(scratch);
  setenv("TMPDIR", scratch.c_str(), 1);
  // Only the silent solver runs into its time-out: on a busy machine the others may need more than a second to start.
  for (const Misdeed& misdeed : kFileMisdeeds) {
    DeclareFiles(misdeed.name, misdeed.code, std::string_view(misdeed.name) == "silent" ? 1.0 : 60.0);
  }
  ExpectReasons(kFileMisdeeds);
  EXPECT_NE(std::system("pgrep -f '^sleep 86396$' >/dev/null"), 0) << "processes of a solver are left";
  unsetenv("TMPDIR");
  EXPECT_TRUE(std::filesystem::is_empty(scratch));
}

TEST_F(SolverCommand, ASolverThatIsHandedFilesIsARowBesideOurs) {
  const std::string example = SourceFolder() + "/examples/solvers/newton_step.json";
  const ProgramResult checked = Run({"service", "check-solver", example});
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  test::WriteText(folder_.path() / "files.yaml",
                  "tasks: [{task: posture, problems: [0-3]}]\ninitializations: [good]\n"
                  "methods: [{solver: newton_step, options: {max_rounds: 20}}]\nlimits: {memory_mb: 2048}\n");
  const ProgramResult result = Run({"run", "files.yaml", "--solver", example, "--db", "a.sqlite", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto table = nlohmann::json::parse(result.out);
  EXPECT_EQ(table.at("rows").at(0).at("method"), "newton_step (external)");
  EXPECT_GE(table.at("rows").at(0).at("posture").at("good").at("solved"), 3);
}

// Solutions of the built-in SQP are returned as configurations.
TEST_F(SolverCommand, ASolutionMayBeWaypoints) {
  const std::string suite =
      "tasks: [{task: posture, problems: [0-3]}]\ninitializations: [good]\nlimits: {memory_mb: 2048}\n";
  test::WriteText(folder_.path() / "sqp.yaml", suite + "methods: [{solver: sqp}]\n");
  ASSERT_EQ(Run({"run", "sqp.yaml", "--db", "sqp.sqlite"}).exit_code, 0);
  DeclareFiles("recall",
               "import sqlite3, struct\n"
               "robot = problem['robot']\n"
               "assert len(robot['joints']) + 7 == len(robot['start'][0]) and robot['footholds'][0][0]['link']\n"
               "assert os.path.exists(robot['urdf']) and os.path.isdir(robot['dataset'])\n"
               "found = [struct.unpack('<%dd' % len(robot['start'][0]), x) for x, in\n"
               "         sqlite3.connect('sqp.sqlite').execute('SELECT x FROM waypoints')]\n"
               "base = len(robot['joints'])\n"
               "far = lambda x: sum((a - b) ** 2 for a, b in zip(x[base:base + 2], robot['start'][0][base:base + 2]))\n"
               "leave({'waypoints': [min(found, key=far)]})");
  test::WriteText(folder_.path() / "recall.yaml", suite + "methods: [{solver: recall}]\n");
  const ProgramResult result = Run({"run", "recall.yaml", "--solver", "recall.json", "--db", "a.sqlite"});
  ASSERT_EQ(result.exit_code, 0) << result.err << Reasons("a.sqlite")["recall (external)"];
  const ProgramResult listed = Run({"query", "SELECT sum(verdict_literal = 'success') AS solved FROM results", "--db",
                                    "a.sqlite", "--format", "json"});
  EXPECT_EQ(nlohmann::json::parse(listed.out).at(0).at("solved"), 4);
}

TEST_F(SolverCommand, RowsOfSolversOfOthersAreReplayed) {
  const std::string examples = SourceFolder() + "/examples/solvers/";
  test::WriteText(folder_.path() / "both.yaml",
                  "tasks: [{task: posture, problems: [0, 1]}]\ninitializations: [good]\n"
                  "methods: [{solver: sqp}, {solver: stay}, {solver: newton_step}]\nlimits: {memory_mb: 2048}\n");
  const std::vector<std::string> both = {"--solver", examples + "stay.json", "--solver", examples + "newton_step.json"};
  const auto with = [&](std::vector<std::string> words) {
    words.insert(words.end(), {"--db", "a.sqlite"});
    words.insert(words.end(), both.begin(), both.end());
    return Run(words);
  };
  ASSERT_EQ(with({"run", "both.yaml"}).exit_code, 0);
  const ProgramResult replayed = with({"replay", "--random", "6", "--jobs", "2"});
  EXPECT_EQ(replayed.exit_code, 0) << replayed.out << replayed.err;
  EXPECT_THAT(replayed.out, HasSubstr("6 of 6 bit-identical"));
  const ProgramResult without = Run({"replay", "--random", "6", "--db", "a.sqlite"});
  EXPECT_EQ(without.exit_code, kUsage);
  EXPECT_THAT(without.err, HasSubstr("--solver FILE"));
}

TEST_F(SolverCommand, MemoryAndCpuTimeAreTheSolversOwn) {
  Declare("greedy",
          "def work(seconds):\n"
          "  end = time.process_time() + seconds\n"
          "  while time.process_time() < end: pass\n"
          "work(1.5); hello(); p = solve(); held = bytearray(200 << 20); held[::4096] = b'x' * len(held[::4096])\n"
          "work(0.3); say({'type': 'solution', 'x': [0.0] * p['variables'], 'status': 'limit'}); solve()");
  test::WriteText(folder_.path() / "greedy.json",
                  R"({"name": "greedy", "command": ["/usr/bin/python3", "greedy.py"], "timeout_s": 60})");
  test::WriteText(folder_.path() / "greedy.yaml",
                  "tasks: [{task: posture, problems: [0]}]\ninitializations: [good]\n"
                  "methods: [{solver: greedy}]\nlimits: {memory_mb: 2048}\n");
  const ProgramResult result = Run({"run", "greedy.yaml", "--solver", "greedy.json", "--db", "a.sqlite"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const ProgramResult listed =
      Run({"query", "SELECT cpu_us, peak_memory_bytes FROM results", "--db", "a.sqlite", "--format", "json"});
  const nlohmann::json row = nlohmann::json::parse(listed.out).at(0);
  EXPECT_GT(row.at("cpu_us"), 300'000);
  EXPECT_LT(row.at("cpu_us"), 1'500'000) << "what it takes to start is nobody's solve";
  EXPECT_GT(row.at("peak_memory_bytes"), 200 << 20);
  EXPECT_LT(row.at("peak_memory_bytes"), 300 << 20);
}

// Signs and names are those of docs/reference/external-solvers.md. A failed assertion ends the solver, and the job
// dies.
TEST_F(SolverCommand, ContactsComeWithTheEvaluation) {
  test::WriteText(folder_.path() / "touch.py", "import sys\nsys.path.insert(0, '" + SourceFolder() +
                                                   "/python')\n"
                                                   R"(import legopt.solver
def solve(problem):
    x = problem.start()
    assert problem.evaluate(x).contacts is None
    at = problem.evaluate(x, contacts=True)
    assert at.contacts and any(c.other is None and c.depth > 0.01 for c in at.contacts), at.contacts
    for c in at.contacts:
        assert c.waypoint == 0 and c.link and c.link != c.other
        assert abs(sum(n * n for n in c.normal) - 1) < 1e-9
        for a, b, n in zip(c.point, c.other_point, c.normal): assert abs(a - b - c.distance * n) < 1e-6, c
        assert any(abs(5e-4 - c.distance - v) < 1e-9 for v in at.values), "each is a row: margin - distance"
    lifted = list(x)
    lifted[-4] += 1.0
    assert problem.evaluate(lifted, contacts=True).contacts != at.contacts
    return problem.best()
legopt.solver.serve(solve, name="touch", version="1")
)");
  test::WriteText(folder_.path() / "touch.json", R"({"name": "touch", "command": ["/usr/bin/python3", "touch.py"]})");
  test::WriteText(folder_.path() / "touch.yaml",
                  "tasks: [{task: posture, problems: [0-2]}]\ninitializations: [in_collision]\n"
                  "methods: [{solver: touch}]\nmax_attempts: 1\nlimits: {memory_mb: 2048}\n");
  const ProgramResult result = Run({"run", "touch.yaml", "--solver", "touch.json", "--db", "a.sqlite"});
  EXPECT_EQ(result.exit_code, 0) << result.err << Reasons("a.sqlite")["touch (external)"];
}

TEST_F(SolverCommand, ShellAndSlsqpAreRowsBesideOurs) {
  if (std::system("/usr/bin/python3 -c 'import scipy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "SKIPPED, NO SCIPY HERE: apt install python3-scipy";
  }
  const std::string examples = SourceFolder() + "/examples/solvers/";
  const ProgramResult result = Run({"run", examples + "external.yaml", "--solver", examples + "slsqp.json", "--solver",
                                    examples + "stay.json", "--db", "a.sqlite", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::map<std::string, nlohmann::json> rows;
  const auto table = nlohmann::json::parse(result.out);
  for (const nlohmann::json& row : table.at("rows")) rows[row.at("method")] = row.at("posture").at("good");
  EXPECT_EQ(rows.at("SQP").at("solved"), 5);
  EXPECT_EQ(rows.at("SLSQP (external)").at("solved"), 5);
  EXPECT_EQ(rows.at("stay (external)").at("solved"), 0) << "it claims nothing, and the judge is not asked to believe";
}

TEST_F(SolverCommand, SlsqpNloptAndShellAreThreeRowsBesideOurs) {
  if (!std::filesystem::exists(BuiltProgram("solvers/nlopt_solver"))) {
    GTEST_SKIP() << "SKIPPED, NLOPT'S SOLVER IS NOT BUILT: apt install libnlopt-dev libnlopt-cxx-dev";
  }
  if (std::system("/usr/bin/python3 -c 'import scipy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "SKIPPED, NO SCIPY HERE: apt install python3-scipy";
  }
  const std::string examples = SourceFolder() + "/examples/solvers/";
  const std::string suite = std::regex_replace(test::ReadText(examples + "external.yaml"), std::regex("methods:\n"),
                                               "methods:\n  - {solver: nlopt}\n");
  test::WriteText(folder_.path() / "three.yaml", suite);
  const ProgramResult result = Run({"run", "three.yaml", "--solver", examples + "slsqp.json", "--solver",
                                    BuiltProgram("solvers/nlopt.json").string(), "--solver", examples + "stay.json",
                                    "--db", "three.sqlite", "--format", "json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::map<std::string, int> solved;
  const auto table = nlohmann::json::parse(result.out);
  for (const nlohmann::json& row : table.at("rows")) {
    solved[row.at("method")] = row.at("posture").at("good").at("solved");
  }
  const std::map<std::string, int> expected = {
      {"SQP", 5}, {"SLSQP (external)", 5}, {"nlopt (external)", 5}, {"stay (external)", 0}};
  EXPECT_EQ(solved, expected);
}

TEST_F(SolverCommand, ADocumentedSessionSaysWhatTheDocumentSays) {
  const std::string document = test::ReadText(SourceFolder() + "/docs/reference/external-solvers.md");
  std::smatch block;
  ASSERT_TRUE(std::regex_search(document, block, std::regex("```console\\n\\$ legopt ([^\\n]*)\\n([^`]*)```")));
  std::filesystem::create_symlink(SourceFolder() + "/examples", folder_.path() / "examples");
  std::istringstream line(block[1].str());
  std::vector<std::string> words;
  for (std::string word; line >> word;) words.push_back(word);
  const auto masked = [](const std::string& text) {
    return std::regex_replace(text, std::regex("after \\d+\\.\\d+ s|took .* a motion| +\\n"), "#");
  };
  EXPECT_EQ(masked(Run(words).out), masked(block[2].str()));
}

TEST_F(SolverCommand, CheckNamesWhatIsWrong) {
  Declare("wrong_size", kMisdeeds[4].code);
  const ProgramResult result = Run({"service", "check-solver", "wrong_size.json"});
  EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kJobsFailed));
  EXPECT_THAT(result.out, AllOf(HasSubstr("ok      hello"), HasSubstr("FAIL    posture"), HasSubstr("1 numbers")));
  EXPECT_THAT(result.out, Not(HasSubstr("motion"))) << "left out after a failure";
}

TEST_F(SolverCommand, BadDeclarationsAreNamed) {
  const auto error_of = [&](const std::string& text) {
    test::WriteText(folder_.path() / "bad.json", text);
    const ProgramResult result = Run({"service", "check-solver", "bad.json"});
    EXPECT_EQ(result.exit_code, kUsage) << text;
    return result.err;
  };
  EXPECT_THAT(error_of("{"), HasSubstr("not valid JSON"));
  EXPECT_THAT(error_of(R"({"name": "x", "command": ["./nowhere"]})"),
              AllOf(HasSubstr("bad.json"), HasSubstr("command"), HasSubstr("no executable file")));
  EXPECT_THAT(error_of(R"({"name": "x", "command": ["legopt-no-such-program"]})"), HasSubstr("is not in PATH"));
  EXPECT_THAT(error_of(R"({"name": "sqp", "command": ["sh"]})"), HasSubstr("is a solver of legopt"));
  EXPECT_THAT(error_of(R"({"name": "x", "comand": ["sh"]})"), HasSubstr("command"));
  EXPECT_THAT(error_of(R"({"name": "x", "command": ["sh"], "level": "file"})"), HasSubstr("'lines' or 'files'"));
  const ProgramResult missing = Run({"run", "quick", "--solver", "nowhere.json"});
  EXPECT_EQ(missing.exit_code, kUsage);
  EXPECT_THAT(missing.err, HasSubstr("nowhere.json"));
}

TEST_F(SolverCommand, AChangedSolverIsNotTheSameMethod) {
  Declare("still",
          "hello()\nwhile True:\n  p = solve()\n"
          "  say({'type': 'solution', 'x': [0.0] * p['variables'], 'status': 'limit'})");
  test::WriteText(folder_.path() / "one.yaml",
                  "tasks: [{task: posture, problems: [0]}]\ninitializations: [good]\nmethods:\n  - {solver: still}\n");
  const auto hash = [&] {
    const ProgramResult dry = Run({"submit", "--dry-run", "one.yaml", "--solver", "still.json", "--format", "json"});
    return std::to_string(dry.exit_code) + dry.out;
  };
  const std::string before = hash();
  EXPECT_THAT(before, HasSubstr("0{"));
  EXPECT_EQ(hash(), before);
  test::WriteText(folder_.path() / "still.py", test::ReadText(folder_.path() / "still.py") + "# another\n");
  EXPECT_NE(hash(), before);
}

}  // namespace
}  // namespace legopt::client
