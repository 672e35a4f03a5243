// External solvers in a pool started by hand: server, workers with --solver, 'legopt submit --solver'.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "tests/client/program_run.h"
#include "tests/dataset/test_data.h"
#include "tests/folders.h"
#include "tests/service/deployment.h"

namespace legopt::service {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

class ExternalPoolTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    for (const char* file : {"stay.sh", "stay.json", "newton_step.py", "newton_step.json"}) {
      std::filesystem::copy_file(SourceFolder() + "/examples/solvers/" + file, folder_ / file);
    }
    test::WriteText(folder_ / "suite.yaml",
                    "tasks: [{task: posture, problems: [0-3]}]\ninitializations: [good]\nmax_attempts: 1\n"
                    "methods: [{solver: sqp}, {solver: stay}, {solver: newton_step}]\nlimits: {memory_mb: 2048}\n");
    deployment_.emplace();
    deployment_->StartServer();
  }

  std::vector<std::string> Declarations() const {
    return {"--solver", (folder_ / "stay.json").string(), "--solver", (folder_ / "newton_step.json").string()};
  }
  std::unique_ptr<client::ChildProcess> StartWorker() const {
    std::vector<std::string> arguments = Declarations();
    arguments.insert(arguments.end(), {"--slots", "2"});
    return deployment_->StartWorker("legopt-worker", arguments);
  }
  client::ProgramResult Submit(std::vector<std::string> words) const {
    words.insert(words.begin(), {"submit", "suite.yaml", "--wait", "--port", std::to_string(deployment_->port())});
    return client::RunLegopt(words, folder_.path());
  }

  std::vector<std::string> Words(std::vector<std::string> words) const {
    words.insert(words.end(), {"--port", std::to_string(deployment_->port())});
    return words;
  }
  client::ProgramResult SubmitAndLeave(std::vector<std::string> words) const {
    words.insert(words.begin(), {"submit", "suite.yaml"});
    return client::RunLegopt(Words(std::move(words)), folder_.path());
  }
  // Returns the capabilities that `status` reports as missing for the experiment, one per line.
  std::string MissingOf(std::int64_t experiment) const {
    const auto result =
        client::RunLegopt(Words({"status", std::to_string(experiment), "--format", "json"}), folder_.path());
    std::string lines;
    EXPECT_EQ(result.exit_code, 0) << result.err;
    const auto status = nlohmann::json::parse(result.out);
    for (const auto& line : status["experiments"][0]["missing"]) {
      lines += (lines.empty() ? "" : "\n") + line.get<std::string>();
    }
    return lines;
  }
  static bool Eventually(const std::function<bool()>& holds) {
    constexpr int kLooks = 300;
    for (int look = 0; look < kLooks; ++look) {
      if (holds()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }
  static constexpr const char* kStaySuite =
      "tasks: [{task: posture, problems: [0-3]}]\ninitializations: [good]\nmax_attempts: 1\n"
      "methods: [{solver: stay}]\n";

  test::TemporaryFolder folder_;
  std::optional<Deployment> deployment_;
};

TEST_F(ExternalPoolTest, WhatIsSubmittedWithDeclarationsIsSolvedByWorkersThatHaveThem) {
  const auto worker = StartWorker();
  const client::ProgramResult result = Submit(Declarations());
  ASSERT_EQ(result.exit_code, 0) << result.err << worker->ErrorTail();
  EXPECT_THAT(deployment_->Query("SELECT method, count(*), sum(state = 'done') FROM job_list GROUP BY 1 ORDER BY 1"),
              ElementsAre("SQP|4|4", "newton_step (external)|4|4", "stay (external)|4|4"));
  EXPECT_THAT(deployment_->Query("SELECT count(*) FROM results WHERE verdict_literal = 'success' AND job_id IN "
                                 "(SELECT job_id FROM job_list WHERE method LIKE 'stay%')"),
              ElementsAre("0"));
}

// Three workers without the solver keep requesting jobs: no attempt is charged, the status names the missing solver,
// and the job ends when a worker with the solver joins.
TEST_F(ExternalPoolTest, WorkersWithoutTheSolverCostNoAttempt) {
  std::vector<std::unique_ptr<client::ChildProcess>> without;
  without.push_back(deployment_->StartWorker("legopt-worker", {"--slots", "1"}));
  without.push_back(deployment_->StartWorker("legopt-worker", {"--slots", "1"}));
  test::WriteText(folder_ / "other.json", R"({"name": "stay", "command": ["./stay.sh"], "settings": {"other": 1}})");
  without.push_back(
      deployment_->StartWorker("legopt-worker", {"--slots", "1", "--solver", (folder_ / "other.json").string()}));
  test::WriteText(folder_ / "suite.yaml", kStaySuite);
  ASSERT_EQ(SubmitAndLeave({"--solver", (folder_ / "stay.json").string()}).exit_code, 0);
  EXPECT_TRUE(Eventually([this] { return MissingOf(1).find("no worker has solver 'stay' (") == 0; })) << MissingOf(1);
  const auto with = deployment_->StartWorker("legopt-worker", {"--solver", (folder_ / "stay.json").string()});
  EXPECT_EQ(Submit({"--solver", (folder_ / "stay.json").string()}).exit_code, 0) << with->ErrorTail();
  EXPECT_THAT(deployment_->Query("SELECT count(*), sum(attempts), sum(state = 'done') FROM jobs"),
              ElementsAre("4|4|4"));
  EXPECT_EQ(MissingOf(1), "");
}

// The solver's files change after the worker's start: the worker refuses each such job without using an attempt.
TEST_F(ExternalPoolTest, AWorkerWhoseSolverHasChangedRefuses) {
  const std::filesystem::path changed = folder_ / "changed";
  std::filesystem::create_directory(changed);
  for (const char* file : {"stay.sh", "stay.json"}) std::filesystem::copy_file(folder_ / file, changed / file);
  const auto first =
      deployment_->StartWorker("legopt-worker", {"--slots", "1", "--solver", (changed / "stay.json").string()});
  EXPECT_TRUE(Eventually([this] {
    const auto workers =
        nlohmann::json::parse(client::RunLegopt(Words({"status", "--format", "json"}), folder_.path()).out)["workers"];
    return workers.size() == 1 && workers[0]["solvers"] == "stay";
  }));
  std::ofstream(changed / "stay.sh", std::ios::app) << "# changed\n";
  test::WriteText(folder_ / "suite.yaml", kStaySuite);
  ASSERT_EQ(SubmitAndLeave({"--solver", (folder_ / "stay.json").string()}).exit_code, 0);
  EXPECT_TRUE(Eventually([this] { return MissingOf(1).find("workers refuse its jobs: ") == 0; })) << MissingOf(1);
  const auto with = deployment_->StartWorker("legopt-worker", {"--solver", (folder_ / "stay.json").string()});
  EXPECT_EQ(Submit({"--solver", (folder_ / "stay.json").string()}).exit_code, 0) << with->ErrorTail();
  EXPECT_THAT(deployment_->Query("SELECT sum(state = 'done'), sum(attempts - returned) FROM jobs"), ElementsAre("4|4"));
  EXPECT_THAT(deployment_->Query("SELECT DISTINCT outcome FROM attempts WHERE message LIKE 'refused: %has changed%'"),
              ElementsAre("returned"));
}

// A solver that prints its environment and ends.
constexpr char kSpy[] = R"spy(
import os, sys
found = ["LEGOPT" if any(name.startswith("LEGOPT_") for name in os.environ) else "no LEGOPT",
         "python " + os.environ.get("PYTHONPATH", "none"), "licence " + os.environ.get("SPY_LICENCE", "none"),
         "secret " + os.environ.get("SPY_SECRET", "none"), "net " + ",".join(sorted(os.listdir("/sys/class/net")))]
for file in ("mem", "environ"):
    try:
        open("/proc/%d/%s" % (os.getppid(), file), "rb").read(0 if file == "mem" else -1)
        found.append(file + " read")
    except OSError:
        found.append(file + " closed")
status = open("/proc/self/status").read()
found.append("NoNewPrivs " + status.split("NoNewPrivs:")[1].split()[0])
found.append("namespace " + os.readlink("/proc/self/ns/net"))
print("; ".join(found), file=sys.stderr)
sys.exit(3)
)spy";

TEST_F(ExternalPoolTest, ASolverIsConfined) {
  test::WriteText(folder_ / "spy.py", kSpy);
  test::WriteText(folder_ / "stay.json",
                  R"({"name": "stay", "command": ["python3", "spy.py"], "environment": ["SPY_LICENCE"]})");
  test::WriteText(folder_ / "suite.yaml",
                  "tasks: [{task: posture, problems: [0]}]\ninitializations: [good]\nmax_attempts: 1\n"
                  "methods: [{solver: stay}]\n");
  ::setenv("LEGOPT_SUBMITTER", "somebody", 1);
  ::setenv("SPY_LICENCE", "/licence", 1);
  ::setenv("SPY_SECRET", "42", 1);
  ::setenv("PYTHONPATH", "/modules", 1);
  const auto worker = StartWorker();
  Submit({"--solver", (folder_ / "stay.json").string()});
  for (const char* name : {"LEGOPT_SUBMITTER", "SPY_LICENCE", "SPY_SECRET", "PYTHONPATH"}) ::unsetenv(name);
  const std::vector<std::string> said = deployment_->Query("SELECT DISTINCT message FROM attempts");
  ASSERT_EQ(said.size(), 1U);
  EXPECT_THAT(said[0], HasSubstr("no LEGOPT; python /modules"));
  EXPECT_THAT(said[0], HasSubstr("; licence /licence; secret none"));
  EXPECT_THAT(said[0], HasSubstr("mem closed; environ closed; NoNewPrivs 1"));
  const std::string own = std::filesystem::read_symlink("/proc/self/ns/net").string();
  if (std::system("unshare -n true 2>/dev/null || unshare -rn true 2>/dev/null") == 0) {
    EXPECT_THAT(said[0], testing::Not(HasSubstr(own))) << "it has a network namespace of its own";
  }
}

}  // namespace
}  // namespace legopt::service
