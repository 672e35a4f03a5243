// Real processes over real LCM: failures that an experiment survives, and start-up errors. Stub jobs (stub_executor.h)
// and the released worker on the embedded dataset.

#include <gtest/gtest.h>

#include <csignal>
#include <cstring>
#include <optional>

#include "app/exit_codes.h"
#include "bus/lcm_transport.h"
#include "db/audit.h"
#include "legopt/types/reply.h"
#include "tests/service/deployment.h"
#include "tests/service/stub_executor.h"

namespace legopt::service {
namespace {

using app::ExitCode;

using std::chrono::milliseconds;
using std::chrono::seconds;
using worker::StubExecutor;

constexpr milliseconds kPatience = seconds(30);

std::string Hex(const std::vector<double>& numbers) {
  std::string hex;
  for (const double number : numbers) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    for (int shift = 0; shift < 64; shift += 8) {  // little endian
      constexpr char kDigits[] = "0123456789abcdef";
      const auto byte = static_cast<unsigned>((bits >> shift) & 0xff);
      hex += {kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return hex;
}

class ServiceTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    deployment_.emplace();
    deployment_->StartServer();
  }

  // Expects that every job is done with exactly one result, the correct one, and that no attempt is open.
  void ExpectComplete(std::int64_t experiment, int jobs) {
    const std::string in_experiment =
        " FROM jobs JOIN cells USING (cell_id) WHERE experiment_id = " + std::to_string(experiment);
    EXPECT_EQ(deployment_->Query("SELECT count(*)" + in_experiment + " AND state = 'done'"),
              std::vector<std::string>{std::to_string(jobs)});
    EXPECT_EQ(deployment_->Query("SELECT count(*) FROM attempts WHERE outcome = 'running'"),
              std::vector<std::string>{"0"});
    const auto rows = deployment_->Query(
        "SELECT j.problem_id, j.repetition, hex FROM (SELECT job_id, problem_id, repetition FROM job_list WHERE "
        "experiment_id = " +
        std::to_string(experiment) +
        ") AS j LEFT JOIN (SELECT job_id, lower(hex(x)) AS hex FROM waypoints) USING (job_id) ORDER BY job_id");
    ASSERT_EQ(rows.size(), static_cast<std::size_t>(jobs));
    for (int i = 0; i < jobs; ++i) {
      EXPECT_EQ(rows[static_cast<std::size_t>(i)], std::to_string(i) + "|0|" + Hex(StubExecutor::Solution(5, i, 0)));
    }
    EXPECT_EQ(deployment_->Query("SELECT count(*) FROM results JOIN attempts USING (job_id, attempt) WHERE outcome = "
                                 "'finished'"),
              deployment_->Query("SELECT count(*) FROM attempts WHERE outcome = 'finished'"));
  }

  std::optional<Deployment> deployment_;
};

TEST_F(ServiceTest, SubmittedJobsAreDoneOnce) {
  const auto first = deployment_->StartStubWorker({"--slots", "2", "--name", "first"});
  const auto second = deployment_->StartStubWorker({"--slots", "2", "--name", "second"});
  ASSERT_TRUE(deployment_->WaitForWorkers(2)) << "one of them might do it all";
  const std::int64_t experiment = deployment_->Submit(StubSpec(400, 2), "a");
  EXPECT_EQ(deployment_->Submit(StubSpec(400, 2), "a"), experiment) << "submitting again changes nothing";
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  ExpectComplete(experiment, 400);
  EXPECT_EQ(deployment_->Query("SELECT count(DISTINCT worker) FROM job_list"), std::vector<std::string>{"2"});
  first->Signal(SIGTERM);
  const auto exit = first->Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kOk)) << first->ErrorTail();
}

// Results are copied once each, even if the server dies several times in between.
TEST_F(ServiceTest, OverlapIsReusedDespiteServerKills) {
  const auto worker = deployment_->StartStubWorker({"--slots", "2"});
  constexpr int kJobs = 1200;
  nlohmann::json spec = StubSpec(kJobs, 0);
  spec.erase("again");
  const std::int64_t first = deployment_->Submit(spec, "a");
  ASSERT_TRUE(deployment_->WaitUntilDone(first));
  spec["name"] = "larger";
  spec["methods"].push_back(StubSpec(1, 1)["methods"][0]);
  const std::int64_t second = deployment_->Submit(spec, "b");
  for (const int jobs : {1, 500, 1300}) {
    ASSERT_TRUE(deployment_->WaitForJobs(second, jobs));
    deployment_->KillServer();
    deployment_->StartServer();
  }
  ASSERT_TRUE(deployment_->WaitUntilDone(second));
  EXPECT_EQ(deployment_->Query("SELECT done, taken_over FROM experiment_list ORDER BY experiment_id"),
            (std::vector<std::string>{"1200|0", "2400|1200"}));
  EXPECT_EQ(
      deployment_->Query("SELECT count(DISTINCT j.taken_from), count(*) FROM jobs AS j JOIN jobs AS s ON s.job_id = "
                         "j.taken_from AND s.problem_key = j.problem_key"),
      std::vector<std::string>{"1200|1200"});
  for (const db::AuditDiagnostic& defect : db::Audit(deployment_->database()))
    ADD_FAILURE() << defect.rule << defect.detail;
}

TEST_F(ServiceTest, AKilledWorkerCostsAttemptsButNoJob) {
  auto victim = deployment_->StartStubWorker({"--slots", "2"});
  const auto other = deployment_->StartStubWorker({"--slots", "1"});
  const std::int64_t experiment = deployment_->Submit(StubSpec(150, 20), "a");
  ASSERT_TRUE(deployment_->WaitForJobs(experiment, 40));
  victim->Signal(SIGKILL);
  victim->Wait(kPatience);
  victim = deployment_->StartStubWorker({"--slots", "2"});
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  ExpectComplete(experiment, 150);
}

TEST_F(ServiceTest, AKilledServerWastesNothing) {
  const auto first = deployment_->StartStubWorker({"--slots", "2"});
  const auto second = deployment_->StartStubWorker({"--slots", "1"});
  const std::int64_t experiment = deployment_->Submit(StubSpec(150, 20), "a");
  for (const int jobs : {30, 80}) {
    ASSERT_TRUE(deployment_->WaitForJobs(experiment, jobs));
    deployment_->KillServer();
    deployment_->StartServer();
  }
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  ExpectComplete(experiment, 150);
  EXPECT_EQ(deployment_->Query("SELECT max(attempts - returned) FROM jobs"), std::vector<std::string>{"1"})
      << "no attempt was lost";
}

TEST_F(ServiceTest, APoisonousJobDiesAloneAfterTwoEqualCrashes) {
  const auto worker = deployment_->StartStubWorker({"--slots", "2"});
  nlohmann::json spec = StubSpec(30, 0);
  spec["methods"][0]["options"]["crash_problem"] = 7;
  spec["methods"][0]["hash"] = std::string(64, 'c');
  const std::int64_t experiment = deployment_->Submit(spec, "a");
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(
      deployment_->Query("SELECT state, count(*), max(attempts - returned) FROM jobs GROUP BY state ORDER BY state"),
      (std::vector<std::string>{"dead|1|2", "done|29|1"}));
  EXPECT_EQ(deployment_->Query("SELECT DISTINCT outcome, exit_signal FROM attempts WHERE outcome <> 'finished'"),
            std::vector<std::string>{"crashed|" + std::to_string(SIGABRT)});
}

TEST_F(ServiceTest, APauseNowReleasesTheRunningJobsAndTheExperimentContinues) {
  const auto worker = deployment_->StartStubWorker({"--slots", "2"});
  const std::int64_t experiment = deployment_->Submit(StubSpec(12, 400), "a");
  ASSERT_TRUE(deployment_->WaitForJobs(experiment, 2));
  legopt_msg::control_request request{};
  request.experiment_id = experiment;
  request.action = static_cast<std::int8_t>(ControlAction::kPauseNow);
  request.reason = "the disk is being moved";
  EXPECT_EQ(deployment_->connection().Control(request).status, static_cast<std::int32_t>(ControlStatus::kOk));
  EXPECT_TRUE(deployment_->WaitFor(experiment, [](const nlohmann::json& status) {
    return status.at("jobs").at("leased") == 0 && status.at("hold_reason") == "the disk is being moved";
  }));
  deployment_->KillServer();
  deployment_->StartServer();
  EXPECT_EQ(deployment_->Query("SELECT hold, (SELECT count(*) FROM attempts WHERE outcome = 'running') FROM "
                               "experiment_list"),
            std::vector<std::string>{"held|0"});
  request.action = static_cast<std::int8_t>(ControlAction::kResume);
  request.reason.clear();
  EXPECT_EQ(deployment_->connection().Control(request).status, static_cast<std::int32_t>(ControlStatus::kOk));
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  ExpectComplete(experiment, 12);
  EXPECT_EQ(deployment_->Query("SELECT max(attempts - returned) FROM jobs"), std::vector<std::string>{"1"});
}

TEST_F(ServiceTest, CancellingStopsRunningJobs) {
  const auto worker = deployment_->StartStubWorker({"--slots", "1"});
  const std::int64_t experiment = deployment_->Submit(StubSpec(5, 60'000), "a");
  ASSERT_TRUE(deployment_->WaitFor(
      experiment, [](const nlohmann::json& status) { return status.at("jobs").at("leased").get<int>() > 0; }));
  deployment_->connection().Cancel(experiment);
  // The slot is free again when the next experiment is done.
  const std::int64_t next = deployment_->Submit(StubSpec(3, 1), "b");
  ASSERT_TRUE(deployment_->WaitUntilDone(next));
  EXPECT_EQ(
      deployment_->Query("SELECT DISTINCT state FROM job_list WHERE experiment_id = " + std::to_string(experiment)),
      std::vector<std::string>{"cancelled"});
  EXPECT_EQ(deployment_->Query("SELECT count(*) FROM results JOIN cells USING (cell_id) WHERE experiment_id = " +
                               std::to_string(experiment)),
            std::vector<std::string>{"0"});
}

// Returns a motion job of the largest size: 300 KB of solution in chunks, complete on disk.
nlohmann::json MotionSpec(int jobs, int work_ms, int waypoints, int waypoints_sent) {
  nlohmann::json spec = StubSpec(jobs, work_ms);
  spec["tasks"][0]["task"] = "motion";
  for (auto& count : spec["tasks"][0]["waypoints"]) count = waypoints;
  auto& method = spec["methods"][0];
  method["options"]["waypoints"] = waypoints_sent;
  method["options"]["windows"] = 100;
  method["options"]["windows_solved"] = waypoints_sent * 100 / waypoints;
  method["hash"] = std::string(60, 'b') + std::to_string(1000 + waypoints_sent);
  return spec;
}

TEST_F(ServiceTest, MotionsOf499StancesArriveWhole) {
  constexpr int kJobs = 6, kWaypoints = 998;
  const auto worker = deployment_->StartStubWorker({"--slots", "2"});
  const std::int64_t experiment = deployment_->Submit(MotionSpec(kJobs, 0, kWaypoints, kWaypoints), "a");
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  for (int job = 1; job <= kJobs; ++job) {
    const auto rows = deployment_->Query("SELECT lower(hex(x)) FROM waypoints WHERE job_id = " + std::to_string(job) +
                                         " ORDER BY waypoint");
    std::string all;
    for (const std::string& row : rows) all += row;
    EXPECT_EQ(rows.size(), static_cast<std::size_t>(kWaypoints));
    EXPECT_TRUE(all == Hex(StubExecutor::Solution(5, job - 1, 0, kWaypoints))) << "job " << job << ": other bits";
  }
  EXPECT_EQ(deployment_->Query("SELECT motion_good_solved FROM benchmark_table"),
            std::vector<std::string>{std::to_string(kJobs)});
  EXPECT_EQ(deployment_->Query("SELECT DISTINCT time_s FROM results"),
            std::vector<std::string>{nlohmann::json(1000 / 1e6 / kWaypoints).dump()})
      << "per waypoint";
}

TEST_F(ServiceTest, WhatWasSolvedOfAMotionIsStored) {
  const auto worker = deployment_->StartStubWorker();
  const std::int64_t experiment = deployment_->Submit(MotionSpec(1, 0, 60, 30), "a");
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(deployment_->Query("SELECT verdict_literal, windows_solved, windows, num_waypoints, (SELECT count(*) FROM "
                               "waypoints) FROM results"),
            std::vector<std::string>{"wrong_waypoint_count|50|100|60|30"});
}

TEST_F(ServiceTest, StatusTellsHowFarARunningMotionIs) {
  const auto worker = deployment_->StartStubWorker();
  const std::int64_t experiment = deployment_->Submit(MotionSpec(1, 60'000, 60, 60), "a");
  nlohmann::json running;
  ASSERT_TRUE(deployment_->WaitFor(experiment, [&running](const nlohmann::json& status) {
    running = status.at("running");
    return !running.empty() && running[0].at("progress_done") > 0;
  }));
  EXPECT_EQ(running[0].at("job"), 1);
  EXPECT_EQ(running[0].at("task"), "motion");
  EXPECT_EQ(running[0].at("progress_total"), 60'000);
  deployment_->connection().Cancel(experiment);
}

TEST_F(ServiceTest, AWorkerThatIsToldToStopGivesItsJobsBack) {
  const auto leaving = deployment_->StartStubWorker({"--slots", "2"});
  const std::int64_t experiment = deployment_->Submit(StubSpec(2, 6'000), "a");
  // Waits for the worker's own report, since the server records a lease before the worker receives it.
  ASSERT_TRUE(
      deployment_->WaitFor(experiment, [](const nlohmann::json& status) { return status.at("running").size() == 2; }));
  leaving->Signal(SIGTERM);
  leaving->Signal(SIGINT);
  const auto exit = leaving->Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kInterrupted)) << leaving->ErrorTail();
  const auto staying = deployment_->StartStubWorker({"--slots", "2"});
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  ExpectComplete(experiment, 2);
  EXPECT_EQ(deployment_->Query("SELECT max(attempts - returned) FROM jobs"), std::vector<std::string>{"1"});
}

TEST_F(ServiceTest, ADatasetMismatchEndsTheWorkerWithBothHashes) {
  deployment_->Submit(StubSpec(3, 0), "a");
  const auto worker = deployment_->StartWorker("stub_worker", {"--slots", "1", "--dataset", "stub-f"});
  const auto exit = worker->Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kDatasetMismatch));
  const std::string error = worker->ErrorTail();
  EXPECT_NE(error.find(std::string(64, 'f')), std::string::npos) << error;
  EXPECT_NE(error.find(std::string(64, 'd')), std::string::npos) << error;
  EXPECT_NE(error.find("--dataset"), std::string::npos) << error;
}

TEST_F(ServiceTest, ASecondServerOnOneDatabaseIsRefused) {
  const auto second = deployment_->ExtraServer(deployment_->database(), bus::FindFreePortPair(bus::RandomSeed()));
  const auto exit = second->Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kDatabaseUnusable)) << second->ErrorTail();
}

TEST_F(ServiceTest, APortThatServesAnotherDeploymentIsRefused) {
  const auto second = deployment_->ExtraServer(deployment_->folder() / "other.sqlite");
  const auto exit = second->Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kNetworkUnusable)) << second->ErrorTail();
}

TEST_F(ServiceTest, AWorkerMayStartBeforeItsServer) {
  deployment_->KillServer();
  const auto worker = deployment_->StartStubWorker();
  deployment_->StartServer();
  const std::int64_t experiment = deployment_->Submit(StubSpec(10, 0), "a");
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  ExpectComplete(experiment, 10);
}

TEST_F(ServiceTest, AWorkerWithoutAServerGivesUpWhenToldTo) {
  deployment_->KillServer();
  const auto worker = deployment_->StartStubWorker({"--slots", "1", "--wait-server", "0.3"});
  const auto exit = worker->Wait(kPatience);
  ASSERT_TRUE(exit);
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kUnreachable));
  EXPECT_NE(worker->ErrorTail().find("legopt-server"), std::string::npos) << worker->ErrorTail();
}

TEST_F(ServiceTest, WrongUsageOfTheWorkerHasItsExitCode) {
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"--slots", "0"}, {"--slot", "2"}, {"--dataset", "/nonexistent/folder"}}) {
    const auto worker = deployment_->StartWorker("legopt-worker", arguments);
    const auto exit = worker->Wait(kPatience);
    ASSERT_TRUE(exit);
    EXPECT_EQ(exit->code, StatusOf(ExitCode::kUsage)) << worker->ErrorTail();
  }
}

}  // namespace
}  // namespace legopt::service
