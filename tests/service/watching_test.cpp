// Real processes over real LCM: a program that watches an experiment or waits for it stays while its server is gone,
// and ends if the server is gone permanently or serves another database.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <optional>
#include <sstream>

#include "legopt/types/reply.h"
#include "tests/client/program_run.h"
#include "tests/service/deployment.h"

namespace legopt::service {
namespace {

using client::ProgramResult;
using client::RunningProgram;
using testing::HasSubstr;

class WatchingTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    deployment_.emplace();
    deployment_->StartServer();
  }

  // Starts `legopt ARGUMENTS` for the deployment; it regards a server as silent after two seconds.
  std::unique_ptr<RunningProgram> Legopt(std::vector<std::string> arguments) {
    for (const std::string& argument :
         {std::string("--port"), std::to_string(deployment_->port()), std::string("--timeout"), std::string("2")}) {
      arguments.push_back(argument);
    }
    return std::make_unique<RunningProgram>(Program("legopt"), arguments, deployment_->folder());
  }
  std::unique_ptr<RunningProgram> Watch(std::int64_t experiment, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"watch", std::to_string(experiment)});
    return Legopt(more);
  }

  // Kills the server and returns when the watcher has noticed.
  void KillUnder(RunningProgram& watcher) {
    deployment_->KillServer();
    ASSERT_TRUE(watcher.WaitForError("waiting for the server to come back"));
  }

  std::optional<Deployment> deployment_;
};

TEST_F(WatchingTest, AWatcherSurvivesKilledServers) {
  const auto worker = deployment_->StartStubWorker();
  const std::int64_t experiment = deployment_->Submit(StubSpec(200, 20), "a");
  const auto watcher = Watch(experiment);
  for (const int jobs : {20, 60}) {
    ASSERT_TRUE(deployment_->WaitForJobs(experiment, jobs));
    ASSERT_NO_FATAL_FAILURE(KillUnder(*watcher));
    deployment_->StartServer();
    ASSERT_TRUE(watcher->WaitForError("the server answers again"));
  }
  const ProgramResult result = watcher->Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("200 of 200 jobs in "));
}

TEST_F(WatchingTest, WhoSubmittedAndWaitsSurvivesAKilledServer) {
  const auto suite = deployment_->folder() / "small.yaml";
  std::ofstream(suite) << "tasks: posture\nproblems: [0-2]\nmethods: [{solver: sqp}]\nrepetitions: 100\n";
  const auto waiting = Legopt({"submit", suite.string(), "--wait"});
  ASSERT_TRUE(waiting->WaitForError("experiment 1:"));
  const auto worker = deployment_->StartWorker("legopt-worker", {"--slots", "1"});
  ASSERT_TRUE(deployment_->WaitForJobs(1, 1));
  ASSERT_NO_FATAL_FAILURE(KillUnder(*waiting));
  deployment_->StartServer();
  const ProgramResult result = waiting->Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("600 of 600 jobs in "));
}

TEST_F(WatchingTest, AnotherDatabaseEndsTheWatch) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(10, 20), "a");
  const auto watcher = Watch(experiment);
  ASSERT_TRUE(watcher->WaitForError("0/10"));
  ASSERT_NO_FATAL_FAILURE(KillUnder(*watcher));
  const auto other = deployment_->ExtraServer(deployment_->folder() / "other.sqlite");
  const ProgramResult result = watcher->Wait();
  EXPECT_EQ(result.exit_code, 6) << result.err;
  EXPECT_THAT(result.err, HasSubstr("came back with another database: there is no experiment 1"));
}

TEST_F(WatchingTest, PatienceHasAnEnd) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(10, 20), "a");
  const auto watcher = Watch(experiment, {"--patience", "0"});
  ASSERT_TRUE(watcher->WaitForError("0/10"));
  deployment_->KillServer();
  const ProgramResult result = watcher->Wait();
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("has not answered for"));
}

TEST_F(WatchingTest, AnInterruptionEndsTheWaitForAServer) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(10, 20), "a");
  const auto watcher = Watch(experiment);
  ASSERT_TRUE(watcher->WaitForError("0/10"));
  ASSERT_NO_FATAL_FAILURE(KillUnder(*watcher));
  ::kill(watcher->pid(), SIGINT);
  const ProgramResult result = watcher->Wait();
  EXPECT_EQ(result.exit_code, 8) << result.err;
  EXPECT_THAT(result.err, HasSubstr("continues unwatched"));
}

TEST_F(WatchingTest, TellsWhyNothingMovesAsLongAsThatIsSo) {
  const std::int64_t experiment = deployment_->Submit(StubSpec(10, 20), "a");
  const auto watcher = Watch(experiment);
  ASSERT_TRUE(watcher->WaitForError("no worker is connected"));
  legopt_msg::control_request request{};
  request.experiment_id = experiment;
  request.action = static_cast<std::int8_t>(ControlAction::kPauseNow);
  request.reason = "the disk";
  deployment_->connection().Control(request);
  ASSERT_TRUE(watcher->WaitForError("paused: the disk; 'legopt resume 1' continues it"));
  request.action = static_cast<std::int8_t>(ControlAction::kResume);
  request.reason = "";
  deployment_->connection().Control(request);
  const auto worker = deployment_->StartStubWorker();
  const ProgramResult result = watcher->Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

TEST_F(WatchingTest, AsJsonEachLineIsAnEventAndTheLastTheEnd) {
  const auto worker = deployment_->StartStubWorker();
  const std::int64_t experiment = deployment_->Submit(StubSpec(100, 20), "a");
  const auto watcher = Watch(experiment, {"--format", "json", "--interval", "0.1"});
  ASSERT_TRUE(deployment_->WaitForJobs(experiment, 10));
  deployment_->KillServer();
  ASSERT_TRUE(watcher->WaitForOutput([](const std::string& text) { return text.find("\"silent\"") != text.npos; }));
  deployment_->StartServer();
  const ProgramResult result = watcher->Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(result.out);
  std::vector<nlohmann::json> events;
  for (std::string line; std::getline(lines, line);) events.push_back(nlohmann::json::parse(line));
  ASSERT_GE(events.size(), 4U);
  EXPECT_EQ(events.front().at("event"), "progress");
  EXPECT_EQ(events.back().at("event"), "end");
  EXPECT_EQ(events.back().at("exit_code"), 0);
  EXPECT_EQ(events.back().at("state"), "done");
  EXPECT_EQ(events.back().at("done"), 100);
}

}  // namespace
}  // namespace legopt::service
