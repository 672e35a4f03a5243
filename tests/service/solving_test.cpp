// The released server, worker and dataset: the same experiment gives the same bits, with and without disturbances.

#include <gtest/gtest.h>

#include <csignal>

#include "tests/service/deployment.h"
#include "tests/service/posture_spec.h"

namespace legopt::service {
namespace {

class SolvingTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    deployment_.emplace();
    deployment_->StartServer();
  }

  std::unique_ptr<client::ChildProcess> StartWorker(int slots) {
    return deployment_->StartWorker("legopt-worker",
                                    {"--slots", std::to_string(slots), "--dataset", DefaultDataset().string()});
  }

  // Returns everything about the solutions except times and workers.
  std::vector<std::string> Solutions(std::int64_t experiment) {
    return deployment_->Query(
        "SELECT initialization, problem_id, repetition, state, r.solver_status, r.iterations, r.verdict_literal, "
        "r.verdict_strict, r.cost, hex(x) FROM job_list LEFT JOIN results AS r USING (job_id) LEFT JOIN waypoints "
        "USING "
        "(job_id) WHERE experiment_id = " +
        std::to_string(experiment) + " ORDER BY initialization, problem_id, repetition, waypoint");
  }

  std::optional<Deployment> deployment_;
};

TEST_F(SolvingTest, TheSameExperimentGivesTheSameBitsDisturbedOrNot) {
  const nlohmann::json spec = PostureSpec(10);
  auto worker = StartWorker(2);
  const std::int64_t calm = deployment_->Submit(spec, "calm");
  ASSERT_TRUE(deployment_->WaitUntilDone(calm));

  const auto second = StartWorker(1);
  const std::int64_t disturbed = deployment_->Submit(spec, "disturbed");
  const auto jobs = static_cast<int>(spec["tasks"][0]["problems"].size()) * 2 * 10;
  ASSERT_TRUE(deployment_->WaitForJobs(disturbed, jobs / 8));
  deployment_->KillServer();
  deployment_->StartServer();
  ASSERT_TRUE(deployment_->WaitForJobs(disturbed, jobs / 4));
  worker->Signal(SIGKILL);
  worker = StartWorker(2);
  ASSERT_TRUE(deployment_->WaitUntilDone(disturbed));

  const std::vector<std::string> expected = Solutions(calm);
  ASSERT_EQ(expected.size(), static_cast<std::size_t>(jobs));
  EXPECT_EQ(Solutions(disturbed), expected);
  const std::string table =
      "SELECT initialization, n, finished, solved, cost FROM benchmark_cells WHERE rule = 'literal' AND experiment_id "
      "= ";
  EXPECT_EQ(deployment_->Query(table + std::to_string(calm)), deployment_->Query(table + std::to_string(disturbed)));
}

}  // namespace
}  // namespace legopt::service
