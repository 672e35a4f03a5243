// Policy: a solver of others is a row of the table, judged like all others. What it does wrong costs one attempt of its
// job, with a reason, and leaves nothing behind; the jobs of others do not feel it. docs/solvers.md says what happens.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "program_run.h"
#include "programs/exit_codes.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"

namespace legopt::client {
namespace {

using programs::ExitCode;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// What every misbehaving solver below begins with.
constexpr char kManners[] = R"(import json, subprocess, sys, time
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

class SolverCommand : public testing::Test {
 protected:
  void Declare(const std::string& name, const std::string& code) const {
    test::WriteText(folder_.path() / (name + ".py"), kManners + code + "\n");
    const nlohmann::json declaration = {
        {"name", name}, {"command", {"/usr/bin/python3", name + ".py"}}, {"timeout_s", 1.0}};
    test::WriteText(folder_.path() / (name + ".json"), declaration.dump());
  }
  ProgramResult Run(const std::vector<std::string>& words) const { return RunLegopt(words, folder_.path()); }
  // The reason of every job's only attempt, by method.
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

  test::TemporaryFolder folder_;
};

TEST_F(SolverCommand, MisdeedsCostAnAttemptHaveAReasonAndLeaveNothing) {
  std::string methods = "  - {solver: sqp}\n";
  std::vector<std::string> words = {"run", "bad.yaml", "--db", "bad.sqlite"};
  for (const Misdeed& misdeed : kMisdeeds) {
    Declare(misdeed.name, misdeed.code);
    methods += std::string("  - {solver: ") + misdeed.name + "}\n";
    words.insert(words.end(), {"--solver", std::string(misdeed.name) + ".json"});
  }
  test::WriteText(folder_.path() / "bad.yaml",
                  "tasks: [{task: posture, problems: [0]}]\ninitializations: [good]\nmax_attempts: 1\nmethods:\n" +
                      methods + "limits: {memory_mb: 256}\n");
  const ProgramResult result = Run(words);
  EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kJobsFailed)) << result.err;
  auto reasons = Reasons("bad.sqlite");
  for (const Misdeed& misdeed : kMisdeeds) {
    EXPECT_THAT(reasons[std::string(misdeed.name) + " (external)"],
                AllOf(HasSubstr("solver '" + std::string(misdeed.name) + "' (external) "), HasSubstr(misdeed.reason)));
  }
  EXPECT_EQ(reasons["SQP"], "");
  EXPECT_NE(std::system("pgrep -f '^sleep 86397$' >/dev/null"), 0) << "processes of a solver are left";
  EXPECT_LE(std::filesystem::file_size(folder_.path() / "out"), std::uintmax_t{64} << 20);
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
  const std::string document = test::ReadText(SourceFolder() + "/docs/solvers.md");
  std::smatch block;
  ASSERT_TRUE(std::regex_search(document, block, std::regex("```console\\n\\$ legopt ([^\\n]*)\\n([^`]*)```")));
  std::filesystem::create_symlink(SourceFolder() + "/examples", folder_.path() / "examples");
  std::istringstream line(block[1].str());
  std::vector<std::string> words;
  for (std::string word; line >> word;) words.push_back(word);
  const auto masked = [](const std::string& text) {
    return std::regex_replace(text, std::regex("after \\d+\\.\\d+ s| +\\n"), "#");
  };
  EXPECT_EQ(masked(Run(words).out), masked(block[2].str()));
}

TEST_F(SolverCommand, CheckNamesWhatIsWrong) {
  Declare("wrong_size", kMisdeeds[4].code);
  const ProgramResult result = Run({"solver", "check", "wrong_size.json"});
  EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kJobsFailed));
  EXPECT_THAT(result.out, AllOf(HasSubstr("ok      hello"), HasSubstr("FAIL    posture"), HasSubstr("1 numbers")));
  EXPECT_THAT(result.out, Not(HasSubstr("motion"))) << "left out after a failure";
}

TEST_F(SolverCommand, BadDeclarationsAreNamed) {
  const auto error_of = [&](const std::string& text) {
    test::WriteText(folder_.path() / "bad.json", text);
    const ProgramResult result = Run({"solver", "check", "bad.json"});
    EXPECT_EQ(result.exit_code, kUsage) << text;
    return result.err;
  };
  EXPECT_THAT(error_of("{"), HasSubstr("no JSON"));
  EXPECT_THAT(error_of(R"({"name": "x", "command": ["./nowhere"]})"),
              AllOf(HasSubstr("bad.json"), HasSubstr("command"), HasSubstr("no executable file")));
  EXPECT_THAT(error_of(R"({"name": "x", "command": ["legopt-no-such-program"]})"), HasSubstr("is not in PATH"));
  EXPECT_THAT(error_of(R"({"name": "sqp", "command": ["sh"]})"), HasSubstr("is a solver of legopt"));
  EXPECT_THAT(error_of(R"({"name": "x", "comand": ["sh"]})"), HasSubstr("command"));
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
