// Policy: a command that reads results from a server or, with --db, from a file prints and writes the same bytes from
// both. Every such command has a row below; a new one without a row fails this test.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <sstream>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "command_line_fixture.h"
#include "db/sqlite_store.h"
#include "legopt/planning/internal/trace.h"
#include "tests/client/raw_http.h"
#include "tests/dataset/synthetic_dataset.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;
using Words = std::vector<std::string>;

std::string Joined(const Words& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

// Commands on an experiment with solved, failed, dead and cancelled jobs. Words FILE.* name output files; FOLDER is
// the dataset.
const std::vector<Words> kCommands = {
    {"table"},
    {"table", "1", "--format", "markdown"},
    {"table", "1", "--format", "latex"},
    {"table", "1", "--format", "csv"},
    {"table", "1", "--format", "json"},
    {"table", "1", "--rule", "strict", "--time-unit", "s"},
    {"table", "1", "--statistics"},
    {"table", "1", "--statistics", "--format", "json"},
    {"table", "1", "--statistics", "--charge", "3"},
    {"table", "1", "--profile", "--format", "csv"},
    {"table", "1", "--interpolation"},
    {"table", "1", "--paper"},
    {"table", "1", "--plot", "--svg", "FILE.svg"},
    {"table", "9"},
    {"table", "1", "--methods", "A", "--initializations", "good", "--columns", "method,success"},
    {"table", "1", "--statistics", "--rows", "1", "--tasks", "posture"},
    {"table", "1", "--methods", "C"},
    {"compare", "A", "B"},
    {"compare", "A", "B", "--initializations", "good", "--columns", "task,change"},
    {"compare", "A", "B", "--format", "markdown"},
    {"compare", "A", "B", "--format", "json"},
    {"compare", "A", "B", "--plot", "--svg", "FILE.svg"},
    {"compare", "A", "C"},
    {"plot", "ecdf", "1", "--out", "FILE.svg"},
    {"plot", "scatter", "--methods", "A,B", "--out", "FILE.csv"},
    {"plot", "convergence", "1", "--out", "FILE.pdf"},
    {"archive", "pack", "1", "--out", "FILE.legopt-archive"},
    {"show", "1"},
    {"show", "1", "--format", "json"},
    {"show", "3"},
    {"show", "--methods", "A", "--initializations", "in_collision"},
    {"show", "--methods", "A"},
    {"show", "4"},
    {"list"},
    {"list", "1", "--format", "csv"},
    {"list", "1", "--format", "json"},
    {"list", "1", "--unsolved"},
    {"list", "1", "--methods", "A,B", "--initializations", "good", "--rows", "2", "--columns", "job,method"},
    {"show", "1", "--trace"},
    {"show", "1", "--trace", "--format", "csv", "--out", "FILE.csv"},
    {"show", "2", "--trace"},
    {"show", "3", "--logs"},
    {"show", "1", "--logs"},
    {"service", "events", "1"},  // a server adds events of its start, which belong to no experiment
    {"service", "events", "1", "--format", "json"},
    {"query", "SELECT * FROM benchmark_table"},
    {"query", "SELECT * FROM benchmark_table", "--format", "csv"},
    {"query", "SELECT x, hex(x) FROM waypoints"},
    {"query", "SELECT x AS a, x AS a FROM waypoints", "--format", "json"},
    {"query", "SELECT trace FROM results ORDER BY job_id", "--format", "csv"},
    {"query", "SELECT 9e999, -9e999, 1e-320, -0.0, 9007199254740993, CAST(x'61ff62' AS TEXT), x'00ff', NULL, 'a''b'"},
    {"query", "SELECT 9e999, -9e999, 1e-320, -0.0, 9007199254740993, CAST(x'61ff62' AS TEXT), x'00ff'", "--format",
     "csv"},
    {"query", "SELECT 9e999, -9e999, 1e-320, -0.0, 9007199254740993, CAST(x'61ff62' AS TEXT), x'00ff'", "--format",
     "json"},
    {"query", "SELECT job_id FROM jobs", "--max-rows", "2"},
    {"query", "SELECT nothing"},
    {"query", "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) FROM n", "--limit",
     "0.2"},
    {"export", "1", "--dataset", "FOLDER", "--out", "FILE.json"},
    {"export", "1", "--methods", "A", "--dataset", "FOLDER", "--out", "FILE.json"},
    {"replay", "1", "--dataset", "FOLDER"},
    {"replay", "--random", "1", "--methods", "B", "--dataset", "FOLDER"},
    {"report", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"report", "1", "--rule", "solid", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"report", "--methods", "A", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"view", "1", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"view", "--methods", "A", "--initializations", "good", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"view", "2", "--ghost", "1", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"view", "3", "--dataset", "FOLDER", "--out", "FILE.html"},
    {"view", "99", "--dataset", "FOLDER", "--out", "FILE.html"}};

// status: only a server can report itself and its workers. serve: has a separate test below.
const std::set<std::string> kOtherwise = {"status", "serve"};

constexpr std::int64_t kCancelled_us = 1'700'000'009'000'000;

class ServerOrFile : public CommandLine {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(BuiltProgram("legopt-server"))) GTEST_SKIP() << "legopt-server is not built";
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
    try {
      port_ = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
    } catch (const bus::BusError& error) {
      GTEST_SKIP() << error.what();
    }
    WriteDatabase();
    std::filesystem::copy_file(file_, folder_.path() / "served.sqlite");
    server_.emplace(BuiltProgram("legopt-server"), Words{"--db", "served.sqlite", "--port", port_}, folder_.path());
    ASSERT_TRUE(server_->WaitForOutput([](const std::string& out) { return out.find("ready") != std::string::npos; }));
  }

  void TearDown() override {
    if (!server_) return;
    ::kill(server_->pid(), SIGTERM);
    EXPECT_EQ(server_->Wait().exit_code, 0);
  }

  void WriteDatabase() {
    dataset_ = Dataset::Load(test::SyntheticFolder(data_.path()).path());
    Eigen::VectorXd off = test::StandingUpright();
    off[test::kBaseY] += 0.01;
    const std::vector<IterationRecord> records = {{.step = 0, .cost = 401.25, .violation = 0.5, .evaluations = 10},
                                                  {.step = 4, .cost = 1.0 / 3, .accepted = true, .evaluations = 40}};
    TestExperiment experiment;
    experiment.dataset_hash = dataset_->content_hash();
    experiment.name = "caf\xC3\xA9 <b>";
    experiment.methods = {{"A"}, {"B"}};
    experiment.results = {{.method = 0,
                           .problem = 0,
                           .cost = 300.125,
                           .waypoints = {test::StandingUpright()},
                           .trace = EncodeTrace(records)},
                          {.method = 1, .problem = 0, .verdict = "foot_pose", .wall_us = 2000, .waypoints = {off}},
                          {.method = 0, .initialization = "in_collision", .problem = 0, .dead = true},
                          {.method = 1, .initialization = "in_collision", .problem = 0, .finished = false}};
    WriteTestDatabase(file_, experiment);
    // The experiment is over and its specification made up, so a server must not resume it.
    db::OpenSqliteStore(file_)->Apply(std::vector<db::StoreOp>{db::CancelExperiment{1, kCancelled_us}});
  }

  std::string Text(const std::string& name) const {
    std::ifstream stream(folder_.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  // Returns the output and the files that the command wrote.
  std::vector<std::string> RunOn(const Words& source, const std::string& name, Words command, int* exit_code) {
    std::vector<std::string> files;
    for (std::string& word : command) {
      if (word == "FOLDER") word = data_.path().string();
      if (!word.starts_with("FILE")) continue;
      word = name + word.substr(4);
      files.push_back(word);
    }
    command.insert(command.end(), source.begin(), source.end());
    const ProgramResult result = Run(command);
    *exit_code = result.exit_code;
    errors_ = result.err;
    std::vector<std::string> written = {result.out};
    for (const std::string& file : files) written.push_back(Text(file));
    return written;
  }

  TemporaryFolder data_;
  std::shared_ptr<const Dataset> dataset_;
  std::filesystem::path file_ = folder_.path() / "results.sqlite";
  std::string port_, errors_;
  std::optional<RunningProgram> server_;
};

TEST_F(ServerOrFile, EveryCommandGivesTheSameBytes) {
  for (const Words& command : kCommands) {
    int code_of_file = -1, code_of_server = -1;
    const auto of_file = RunOn({"--db", file_.string()}, "file", command, &code_of_file);
    const std::string errors_of_file = errors_;
    const auto of_server = RunOn({"--port", port_}, "server", command, &code_of_server);
    EXPECT_EQ(code_of_server, code_of_file) << Joined(command) << "\n" << errors_of_file << errors_;
    EXPECT_NE(code_of_file, app::StatusOf(app::ExitCode::kInternal)) << Joined(command) << errors_of_file;
    ASSERT_EQ(of_server.size(), of_file.size());
    for (std::size_t i = 0; i < of_file.size(); ++i) {
      EXPECT_TRUE(of_server[i] == of_file[i]) << Joined(command) << ": " << (i == 0 ? "output" : "file") << " of "
                                              << of_server[i].size() << " and " << of_file[i].size() << " bytes\n"
                                              << of_server[i].substr(0, 2000) << "\n"
                                              << of_file[i].substr(0, 2000);
    }
    EXPECT_THAT(errors_ + errors_of_file, testing::Not(HasSubstr("restore a backup"))) << Joined(command);
  }
}

TEST_F(ServerOrFile, NoSuchCommandIsForgotten) {
  std::set<std::string> tried = kOtherwise;
  for (const Words& command : kCommands) tried.insert(command.front());
  std::istringstream help(Run({"--help"}).out);
  bool listed = false;
  for (std::string line; std::getline(help, line);) {
    if (line == "Experiments:") listed = true;
    std::istringstream words(line);
    std::string name;
    if (!listed || !line.starts_with("  ") || !(words >> name)) continue;
    const std::string options = Run({name, "--help"}).out;
    if (options.find("instead of asking the server") == std::string::npos) continue;
    EXPECT_TRUE(tried.contains(name)) << "'" << name << "' reads from a server or a file: add it to kCommands";
  }
  EXPECT_TRUE(listed);
}

TEST_F(ServerOrFile, TheLivePageSendsTheSameBlocks) {
  const auto serve = [&](const Words& source) {
    Words arguments = {"serve", "--http-port", "0", "--dataset", data_.path().string()};
    arguments.insert(arguments.end(), source.begin(), source.end());
    return std::make_unique<RunningProgram>(BuiltProgram("legopt"), arguments, folder_.path());
  };
  const auto of_file = serve({"--db", file_.string()}), of_server = serve({"--port", port_});
  const auto port = [](RunningProgram& program) {
    std::string url;
    program.WaitForOutput([&](const std::string& out) {
      url = out.substr(0, out.find('\n'));
      return out.find('\n') != std::string::npos;
    });
    return test::PortOf(url);
  };
  const std::uint16_t file_port = port(*of_file), server_port = port(*of_server);
  for (const char* block :
       {"page", "solutions-1", "motion-1", "solutions-2", "motion-2", "solutions-3", "solutions-4"}) {
    const auto body = [&](std::uint16_t at) {
      const std::string answer = test::Fetch(at, std::string("/blocks/") + block);
      return answer.substr(0, answer.find('\r')) + answer.substr(answer.find("\r\n\r\n"));
    };
    const std::string file = body(file_port), server = body(server_port);
    EXPECT_GT(file.size(), 40U) << block;
    EXPECT_TRUE(file == server) << block << "\n" << file.substr(0, 200) << "\n" << server.substr(0, 200);
  }
}

}  // namespace
}  // namespace legopt::client
