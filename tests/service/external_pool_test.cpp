// Solvers of others in a pool that was started by hand: server, workers with --solver, 'legopt submit --solver'.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

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

TEST_F(ExternalPoolTest, AWorkerWhoseSolverIsAnotherRefusesAndSaysWhy) {
  const auto worker = StartWorker();
  test::WriteText(folder_ / "other.json", R"({"name": "stay", "command": ["./stay.sh"], "settings": {"other": 1}})");
  test::WriteText(folder_ / "suite.yaml",
                  "tasks: [{task: posture, problems: [0-3]}]\ninitializations: [good]\nmax_attempts: 1\n"
                  "methods: [{solver: stay}]\n");
  EXPECT_EQ(Submit({"--solver", (folder_ / "other.json").string()}).exit_code,
            static_cast<int>(programs::ExitCode::kJobsFailed))
      << worker->ErrorTail();
  const std::vector<std::string> reasons = deployment_->Query("SELECT DISTINCT message FROM attempts");
  ASSERT_EQ(reasons.size(), 1U);
  EXPECT_THAT(reasons[0], HasSubstr("the job was submitted with another declaration"));
}

}  // namespace
}  // namespace legopt::service
