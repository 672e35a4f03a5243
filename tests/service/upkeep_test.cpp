// Use of a shared pool: `legopt` itself against a server and stub workers over real LCM. A long suite does not delay a
// short one, jobs stopped by the wall-time limit are retried, and experiments get names and tags and are deleted only
// on request.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <memory>
#include <optional>

#include "app/exit_codes.h"
#include "db/audit.h"
#include "tests/client/program_run.h"
#include "tests/service/deployment.h"

namespace legopt::service {
namespace {

using app::ExitCode;
using client::ProgramResult;
using testing::HasSubstr;
using testing::Not;

class UpkeepTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    deployment_.emplace();
    deployment_->StartServer();
  }

  ProgramResult Legopt(std::vector<std::string> arguments) {
    for (const std::string& more :
         {std::string("--port"), std::to_string(deployment_->port()), std::string("--timeout"), std::string("60")}) {
      arguments.push_back(more);
    }
    return client::RunLegopt(arguments, deployment_->folder());
  }
  void ExpectDone(const ProgramResult& result, const std::string& words) {
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr(words));
  }
  void ExpectRefused(const ProgramResult& result, const std::string& words) {
    EXPECT_EQ(result.exit_code, static_cast<int>(ExitCode::kUsage));
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(result.out, "");
  }
  // Returns the number that an SQL query yields.
  std::string Number(const std::string& sql) { return deployment_->Query(sql).at(0); }

  std::optional<Deployment> deployment_;
};

TEST_F(UpkeepTest, AShortSuiteDoesNotWaitForALongOne) {
  const auto worker = deployment_->StartStubWorker({"--slots", "2"});
  nlohmann::json spec = StubSpec(600, 50);  // 15 s of work for two slots
  spec["submitter"] = "ada";
  const std::int64_t long_one = deployment_->Submit(spec, "long");
  ASSERT_TRUE(deployment_->WaitForJobs(long_one, 10));
  spec = StubSpec(20, 50);
  spec["submitter"] = "bob";
  const std::int64_t short_one = deployment_->Submit(spec, "short");
  ASSERT_TRUE(deployment_->WaitUntilDone(short_one));
  EXPECT_EQ(Number("SELECT state FROM experiments WHERE experiment_id = " + std::to_string(long_one)), "active");
  EXPECT_GT(std::stoi(Number("SELECT queued FROM experiment_list WHERE experiment_id = " + std::to_string(long_one))),
            300)
      << "the short one took half of the slots from when it came";
  EXPECT_EQ(Number("SELECT submitter FROM experiments WHERE experiment_id = " + std::to_string(short_one)), "bob");
}

TEST_F(UpkeepTest, WhatTheClockStoppedIsTriedAgain) {
  const auto worker = deployment_->StartStubWorker({"--slots", "1"});
  nlohmann::json spec = StubSpec(3, 0);
  spec["methods"][0]["options"]["stop_problem"] = 1;  // at its first attempt
  spec["methods"][0]["hash"] = std::string(64, 'c');
  const std::string id = std::to_string(deployment_->Submit(spec, "a"));
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_EQ(Number("SELECT count(*) FROM results WHERE solver_status = 'time_limit'"), "1");
  const auto listed = Legopt({"list", id, "--unsolved"});
  ExpectDone(listed, "time_limit");
  EXPECT_THAT(listed.err, HasSubstr("'legopt retry 1 --time-limit'"));
  ExpectDone(Legopt({"retry", id}), "0 jobs queued again");
  ExpectDone(Legopt({"retry", id, "--time-limit"}), "1 job queued again");
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_THAT(Legopt({"list", id, "--unsolved"}).err, Not(HasSubstr("--time-limit")));
  EXPECT_EQ(Number("SELECT count(*) FROM results WHERE solver_status = 'time_limit'"), "0");
  EXPECT_EQ(Number("SELECT count(*) FROM results"), "3");
  EXPECT_EQ(Number("SELECT group_concat(attempt) FROM stale_results WHERE solver_status = 'time_limit'"), "1");
  for (const db::AuditDiagnostic& defect : db::Audit(deployment_->database())) ADD_FAILURE() << defect.detail;
}

// A job stopped by the wall-time limit has no result and is not restarted automatically: the same limit would stop it
// again. Tables report it, and `retry` queues it.
TEST_F(UpkeepTest, TimeLimitStopsAreFlaggedAndRetriedOnRequest) {
  const auto worker = deployment_->StartStubWorker({"--slots", "1"});
  nlohmann::json spec = StubSpec(3, 0);
  spec["methods"][0]["options"]["slow_problem"] = 1;
  spec["methods"][0]["options"]["slow_attempts"] = 1;
  spec["methods"][0]["hash"] = std::string(64, 'c');
  spec["max_attempts"] = 2;
  const std::string id = std::to_string(deployment_->Submit(spec, "a"));
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_EQ(Number("SELECT group_concat(outcome) FROM attempts WHERE job_id = 2"), "time_limit");
  EXPECT_EQ(Number("SELECT count(*) FROM results"), "2");
  EXPECT_EQ(Number("SELECT group_concat(job_id) FROM clock_stopped"), "2");
  ExpectDone(Legopt({"table", id}), "The clock ended 1 job (the wall-time limit");
  ExpectDone(Legopt({"table", id, "--format", "json"}), "\"clock_stopped\": 1");
  EXPECT_THAT(Legopt({"list", id, "--unsolved"}).err, HasSubstr("The clock ended 1 job"));
  ExpectDone(Legopt({"retry", id}), "1 job queued again");
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_EQ(Number("SELECT count(*) FROM results"), "3");
  EXPECT_EQ(Number("SELECT count(*) FROM clock_stopped"), "0");
  EXPECT_THAT(Legopt({"table", id}).out, Not(HasSubstr("clock")));
  for (const db::AuditDiagnostic& defect : db::Audit(deployment_->database())) ADD_FAILURE() << defect.detail;
}

TEST_F(UpkeepTest, NamesAndTags) {
  const std::string id = std::to_string(deployment_->Submit(StubSpec(1, 0), "a"));
  ExpectDone(Legopt({"edit", id, "--name", "night run", "--tag", "paper", "--tag", "draft"}), "named 'night run'");
  EXPECT_EQ(Number("SELECT name FROM experiments"), "night run");
  EXPECT_EQ(Number("SELECT tags FROM experiment_list"), "draft,paper");
  ExpectDone(Legopt({"edit", id, "--untag", "draft", "--priority", "3"}), "tag 'draft' removed");
  ExpectDone(Legopt({"edit", id, "--untag", "draft", "--priority", "3"}), "priority 3");
  EXPECT_EQ(Number("SELECT tags || ' ' || priority FROM experiment_list"), "paper 3");
  ExpectRefused(Legopt({"edit", id}), "give --name, --tag, --untag or --priority");
  ExpectRefused(Legopt({"edit", id, "--name", ""}), "1 to 200 bytes");
  ExpectRefused(Legopt({"edit", id, "--name", std::string(201, 'x')}), "1 to 200 bytes");
  ExpectRefused(Legopt({"edit", id, "--priority", "9", "--tag", "a,b"}), "comma");
  EXPECT_EQ(Number("SELECT priority FROM experiments"), "3") << "all options are checked first";
  ExpectRefused(Legopt({"edit", "9", "--name", "x"}), "no experiment 9");
}

// Makes stub workers of a different build.
class OtherBuild {
 public:
  OtherBuild() { setenv("LEGOPT_STUB_BUILD", "another", 1); }
  ~OtherBuild() { unsetenv("LEGOPT_STUB_BUILD"); }
  OtherBuild(const OtherBuild&) = delete;
  OtherBuild& operator=(const OtherBuild&) = delete;
};

TEST_F(UpkeepTest, AnExperimentIsFinishedByTheBuildThatBeganIt) {
  auto worker = deployment_->StartStubWorker();
  const std::string id = std::to_string(deployment_->Submit(StubSpec(40, 50), "a"));
  ASSERT_TRUE(deployment_->WaitForJobs(1, 2));
  worker->Signal(SIGTERM);
  worker->Wait(std::chrono::seconds(20));
  const std::string begun_by = Number("SELECT build_id FROM experiments");
  EXPECT_EQ(Number("SELECT build_id FROM workers"), begun_by);
  const std::string done = Number("SELECT count(*) FROM results");
  std::unique_ptr<client::ChildProcess> other;
  {
    const OtherBuild build;
    other = deployment_->StartStubWorker();
  }
  ASSERT_TRUE(deployment_->WaitFor(1, [&](const nlohmann::json& status) {
    return status.at("waiting_for").get<std::string>().find("no worker is of build " + begun_by) == 0;
  }));
  const auto status = Legopt({"status"});
  ExpectDone(status, "no worker is of build");
  EXPECT_EQ(Number("SELECT count(*) FROM results"), done);
  ExpectDone(Legopt({"resume", id, "--any-build"}), "workers of any build");
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_EQ(Number("SELECT count(DISTINCT build_id) FROM result_origins"), "2");
  EXPECT_EQ(Number("SELECT sum(results) FROM result_origins"), "40");
  ExpectDone(Legopt({"table", id}), "2 builds: ");
  EXPECT_THAT(Legopt({"table", id, "--format", "json"}).out, HasSubstr(begun_by));
  EXPECT_EQ(db::Audit(deployment_->database()).size(), 0U);
}

TEST_F(UpkeepTest, ASuiteMayLetAnyBuildFinishIt) {
  const auto worker = deployment_->StartStubWorker();
  std::unique_ptr<client::ChildProcess> other;
  {
    const OtherBuild build;
    other = deployment_->StartStubWorker();
  }
  ASSERT_TRUE(deployment_->WaitForWorkers(2));
  nlohmann::json spec = StubSpec(40, 50);
  spec["builds"] = "any";
  deployment_->Submit(spec, "a");
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_EQ(Number("SELECT count(DISTINCT build_id) FROM result_origins"), "2");
}

TEST_F(UpkeepTest, DeletionAsksFirst) {
  const auto worker = deployment_->StartStubWorker();
  const std::string id = std::to_string(deployment_->Submit(StubSpec(3, 0), "a"));
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  const std::string kept = std::to_string(deployment_->Submit(StubSpec(2, 600'000), "b"));
  ExpectRefused(Legopt({"service", "delete", kept, "--yes"}), "cancel it first");
  const auto unsaid = Legopt({"service", "delete", id});
  ExpectRefused(unsaid, "3 jobs, 3 results");
  EXPECT_THAT(unsaid.err, HasSubstr("--yes"));
  EXPECT_EQ(Number("SELECT count(*) FROM results"), "3") << "nothing has happened";
  ExpectDone(Legopt({"service", "delete", id, "--yes"}), "3 jobs, 3 results: deleted");
  EXPECT_EQ(Number("SELECT count(*) FROM results"), "0");
  EXPECT_EQ(deployment_->Query("SELECT experiment_id FROM experiments"), std::vector<std::string>{kept});
  ExpectRefused(Legopt({"service", "delete", id, "--yes"}), "no experiment 1");
  ExpectDone(Legopt({"cancel", kept}), "cancelled");
  ExpectDone(Legopt({"service", "delete", kept, "--yes"}), "deleted");
  deployment_->KillServer();
  deployment_->StartServer();
  EXPECT_EQ(deployment_->Submit(StubSpec(3, 0), "a"), 3) << "numbers are not given again";
}

}  // namespace
}  // namespace legopt::service
