// Policy: users who can submit, hold or report jobs must not be able to control the terminals of others. Every command
// receives names and texts full of escape sequences. Its output for users, on either stream, contains no control
// character except the line end, no C1 control and no bidirectional override. JSON output is safe as well and contains
// the texts unchanged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "program_run.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;

// Colour, window title, a forged second line, an 8-bit CSI, and an override of the reading direction.
const std::string kHostile =
    "Try \x1b[31mred\x1b]0;pwn\x07\nnew\r\xC2\x9B"
    "2J\xE2\x80\xAEtxt\x7f";
// A name that suites may use, with characters that are special in a terminal, Markdown and HTML.
constexpr char kMarkup[] = "Try <b onclick=x>red</b> | `id` $(id) %s & _x_";
constexpr char kMarkupYaml[] = R"("Try <b onclick=x>red</b> | `id` $(id) %s & _x_")";
constexpr char kHostileYaml[] = R"("Try \e[31mred\e]0;pwn\a\nnew\r\x9b2J\u202Etxt\x7f")";

// Returns the first unprintable character with its surroundings; empty if there is none.
std::string FirstHarm(const std::string& text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const bool control = (byte < 0x20 && byte != '\n') || byte == 0x7f;
    const bool c1 = byte == 0xC2 && i + 1 < text.size() && static_cast<unsigned char>(text[i + 1]) < 0xA0;
    const bool override = text.compare(i, 3, "\xE2\x80\xAE") == 0;
    if (control || c1 || override) {
      return "byte " + std::to_string(int{byte}) + " after: " + text.substr(i < 60 ? 0 : i - 60, i < 60 ? i : 60);
    }
  }
  return {};
}

void ExpectHarmless(const ProgramResult& result, const std::string& what) {
  EXPECT_EQ(FirstHarm(result.out), "") << what << ", standard output";
  EXPECT_EQ(FirstHarm(result.err), "") << what << ", standard error";
}

std::string Joined(const std::vector<std::string>& words) {
  std::string text;
  for (const auto& word : words) text += word + " ";
  return text;
}

class HostileText : public testing::Test {
 protected:
  ProgramResult Run(const std::vector<std::string>& arguments) { return RunLegopt(arguments, folder_.path()); }

  std::string Write(const std::string& name, const std::string& text) {
    const auto file = folder_.path() / name;
    std::ofstream(file) << text;
    return file.string();
  }

  std::string Suite(const std::string& more = "", const std::string& name = kMarkupYaml) {
    return Write("suite.yaml", "name: " + name + "\ntasks: posture\nproblems: [0-2]\nmethods: [{solver: sqp, name: " +
                                   name + "}]\n" + more);
  }

  TemporaryFolder folder_;
};

TEST_F(HostileText, EveryCommandOnAFile) {
  const auto db = (folder_.path() / "test.sqlite").string();
  TestExperiment experiment;
  experiment.name = experiment.dataset_name = experiment.text = kHostile;
  experiment.methods = {{kHostile, 0}, {kHostile + "2", 10, "surface"}};
  experiment.results = {{.problem = 0}, {.problem = 1, .verdict = "com"}, {.method = 1, .problem = 0}};
  WriteTestDatabase(db, experiment);
  std::vector<std::vector<std::string>> commands = {{"table"},
                                                    {"list"},
                                                    {"list", "--unsolved"},
                                                    {"status"},
                                                    {"show", "1"},
                                                    {"show", "2"},
                                                    {"table", "--format", "latex"},
                                                    {"table", "--paper"},
                                                    {"query", "SELECT * FROM job_list"},
                                                    {"query", "SELECT * FROM failures"},
                                                    {"query", "SELECT 1 AS \"" + kHostile + "\""},
                                                    {"query", "SELECT '" + kHostile + "' FROM nowhere"},
                                                    {"list", "--method", kHostile},
                                                    {"list", "--verdict", kHostile},
                                                    {"export", "1", "--out", "x.json"}};
  for (auto command : commands) {
    command.insert(command.end(), {"--db", db});
    const auto result = Run(command);
    ExpectHarmless(result, Joined(command));
    EXPECT_NE(result.exit_code, 70) << result.err;
    if (command[0] == "export" || command.size() > 4 || command[0] == "show") continue;
    command.insert(command.end(), {"--format", "markdown"});
    ExpectHarmless(Run(command), Joined(command));
  }
  EXPECT_THAT(Run({"table", "--db", db}).out,
              HasSubstr("Try \\x1b[31mred\\x1b]0;pwn\\x07\\nnew\\r\\u009b2J\\u202etxt"));
}

TEST_F(HostileText, JsonIsHarmlessAndExact) {
  const auto db = (folder_.path() / "test.sqlite").string();
  TestExperiment experiment;
  experiment.name = kHostile;
  experiment.results = {{.problem = 0}};
  WriteTestDatabase(db, experiment);
  const auto table = Run({"table", "--db", db, "--format", "json"});
  EXPECT_EQ(FirstHarm(table.out), "");
  EXPECT_EQ(nlohmann::json::parse(table.out).at("experiment"), kHostile);
  const auto query = Run({"query", "SELECT name FROM experiments", "--db", db, "--format", "json"});
  EXPECT_EQ(FirstHarm(query.out), "");
  EXPECT_EQ(nlohmann::json::parse(query.out).at(0).at("name"), kHostile);
}

TEST_F(HostileText, CsvIsDataAsItIs) {
  const auto db = (folder_.path() / "test.sqlite").string();
  TestExperiment experiment;
  experiment.name = kHostile;
  experiment.results = {{.problem = 0}};
  WriteTestDatabase(db, experiment);
  EXPECT_THAT(Run({"query", "SELECT name FROM experiments", "--db", db, "--format", "csv"}).out, HasSubstr(kHostile));
}

TEST_F(HostileText, CommandLinesFilesAndTheirErrors) {
  const std::string bad = Write("bad.yaml", "tasks: posture\nmethods: [{solver: " + std::string(kHostileYaml) + "}]\n");
  const std::string key = Write("key.yaml", std::string(kHostileYaml) + ": 1\ntasks: posture\n");
  const std::string broken = Write("broken.yaml", "tasks: [\x1b[31m\n");
  const std::string solutions = Write("s.json", "[{\"\x1b[31m\": 1}]");
  const std::vector<std::vector<std::string>> commands = {{kHostile},
                                                          {"help", kHostile},
                                                          {"table", kHostile},
                                                          {"table", "--" + kHostile},
                                                          {"list", "--state", kHostile},
                                                          {"submit", "--dry-run", Suite()},
                                                          {"run", "--dry-run", Suite()},
                                                          {"submit", bad},
                                                          {"submit", key},
                                                          {"run", broken},
                                                          {"submit", kHostile},
                                                          {"submit", "./" + kHostile},
                                                          {"submit", "--dry-run", "quick", "--methods", kHostile},
                                                          {"run", "quick", "--dry-run", "--db", kHostile + ".sqlite"},
                                                          {"evaluate", kHostile},
                                                          {"evaluate", solutions},
                                                          {"submit", "--dry-run", "quick", "--dataset", kHostile},
                                                          {"dataset", "info", kHostile},
                                                          {"import", kHostile, "--out", "x"},
                                                          {"table", "--db", kHostile},
                                                          {"service", "backup", "--db", kHostile, "x"},
                                                          {"service", "doctor", "--dataset", kHostile},
                                                          {"service", "keygen", "/nowhere/" + kHostile},
                                                          {"service", "tap", "--type", kHostile},
                                                          {"service", "tap", "--from", kHostile},
                                                          {"status", "--group", kHostile},
                                                          {"status", "--key-file", kHostile},
                                                          {"service", "keygen", kHostile}};
  for (const auto& command : commands) {
    const auto result = Run(command);
    ExpectHarmless(result, Joined(command));
    EXPECT_NE(result.exit_code, 70) << Joined(command) << result.err;
  }
}

// A server and a worker with a hostile name, and an experiment with hostile names.
class HostilePool : public HostileText {
 protected:
  void SetUp() override {
    for (const char* program : {"legopt-server", "legopt-worker"}) {
      if (!std::filesystem::exists(BuiltProgram(program))) GTEST_SKIP() << program << " is not built";
    }
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
    try {
      port_ = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
    } catch (const bus::BusError& error) {
      GTEST_SKIP() << error.what();
    }
  }

  ProgramResult Ask(std::vector<std::string> command) {
    command.insert(command.end(), {"--port", port_});
    auto result = Run(command);
    ExpectHarmless(result, Joined(command));
    return result;
  }

  std::string port_;
};

TEST_F(HostilePool, EveryCommandOnAServerAndTheLogs) {
  RunningProgram server(BuiltProgram("legopt-server"), {"--db", "pool.sqlite", "--port", port_, "--verbose"},
                        folder_.path());
  ASSERT_TRUE(server.WaitForOutput([](const std::string& out) { return out.find("ready") != std::string::npos; }));
  EXPECT_EQ(Ask({"submit", Suite()}).exit_code, 0);
  const auto run_worker = [this](const std::string& name) {
    RunningProgram worker(BuiltProgram("legopt-worker"),
                          {"--slots", "1", "--name", name, "--port", port_, "--verbose", "--exit-when-idle"},
                          folder_.path());
    const ProgramResult result = worker.Wait();
    ExpectHarmless(result, "log of the worker");
    return result.exit_code;
  };
  EXPECT_EQ(run_worker(kHostile), 2) << "control characters are refused";
  ASSERT_EQ(run_worker(kMarkup), 0);
  EXPECT_EQ(Ask({"watch", "1", "--give-up", "60"}).exit_code, 0);
  Ask({"submit", Suite("seed: 2\n")});
  Ask({"pause", "2", "--now", "--reason", kHostile});
  for (const auto& command : std::vector<std::vector<std::string>>{{"status"},
                                                                   {"status", "2"},
                                                                   {"status", "--format", "markdown"},
                                                                   {"list", "1"},
                                                                   {"table", "1"},
                                                                   {"show", "1"},
                                                                   {"query", "SELECT * FROM experiment_list"},
                                                                   {"query", "SELECT '" + kHostile + "' FROM nowhere"},
                                                                   {"watch", "1"},
                                                                   {"pause", "99"},
                                                                   {"status", "--format", "json"},
                                                                   {"service", "doctor"}}) {
    Ask(command);
  }
  EXPECT_THAT(Ask({"status"}).out, HasSubstr("paused: Try \\x1b[31m"));
  Ask({"cancel", "2"});
  ::kill(server.pid(), SIGTERM);
  ExpectHarmless(server.Wait(), "log of the server");
}

TEST_F(HostilePool, NamesWithControlCharactersAreRefused) {
  const auto result = Run({"submit", Suite("", kHostileYaml), "--dry-run"});
  EXPECT_EQ(result.exit_code, 2) << result.err;
  ExpectHarmless(result, "submit");
}

TEST_F(HostilePool, Run) {
  const auto result = Run({"run", Suite(), "--db", "run.sqlite"});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  ExpectHarmless(result, "run");
}

}  // namespace
}  // namespace legopt::client
