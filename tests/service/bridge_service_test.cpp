// The released server and workers on separate buses, joined only by a bridge: jobs are solved with the same bits, even
// across restarts of the server, which is the hub. A worker that cannot join reports the reason.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "app/exit_codes.h"
#include "bus/bridge/bridge.h"
#include "bus/message_key.h"
#include "tests/service/deployment.h"
#include "tests/service/posture_spec.h"
#include "tests/temporary_folder.h"

namespace legopt::service {
namespace {

using app::ExitCode;

constexpr char kKeyOfTheEnvironment[] = "LEGOPT_KEY_FILE";
constexpr std::chrono::milliseconds kPatience{20'000};

class BridgeServiceTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    key_file_ = (folder_ / "key").string();
    bus::MessageKey::Random()->WriteFile(key_file_);
    setenv(kKeyOfTheEnvironment, key_file_.c_str(), 1);
    deployment_.emplace();
    // Any free port of loopback.
    constexpr bridge::LinkAddress kAnyPort = ~bridge::LinkAddress{0xFFFF};
    listen_ = bridge::ToString(bridge::LinkSocket(bridge::ParseLinkAddress("127.0.0.1:1") & kAnyPort).address());
    deployment_->SetServerArguments({"--listen", listen_, "--access", access()});
  }
  void TearDown() override {
    deployment_.reset();
    unsetenv(kKeyOfTheEnvironment);
  }

  std::string access() const { return (folder_ / "lab.access").string(); }

  // Starts a program on a bus of its own: it gets no port.
  std::unique_ptr<client::ChildProcess> StartBridged(const std::string& program, std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--access", access()});
    return std::make_unique<client::ChildProcess>(Program(program), arguments, true);
  }
  std::unique_ptr<client::ChildProcess> StartBridgedStub() {
    return StartBridged("stub_worker", {"--slots", "2", "--dataset", "stub-d"});
  }

  void ExpectEnd(client::ChildProcess& program, ExitCode code, const std::string& word) {
    const auto exit = program.Wait(kPatience);
    ASSERT_TRUE(exit.has_value());
    EXPECT_EQ(exit->code, StatusOf(code)) << program.ErrorTail();
    EXPECT_NE(program.ErrorTail().find(word), std::string::npos) << program.ErrorTail();
  }
  void ExpectServerEnd(const std::vector<std::string>& arguments, ExitCode code, const std::string& word) {
    deployment_->SetServerArguments(arguments);
    const auto server = deployment_->ExtraServer(folder_ / "refused.sqlite");
    ExpectEnd(*server, code, word);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.sqlite"));
  }

  std::vector<std::string> Solutions(std::int64_t experiment) {
    return deployment_->Query(
        "SELECT initialization, problem_id, repetition, state, r.solver_status, r.iterations, r.verdict_literal, "
        "r.verdict_strict, r.cost, hex(x) FROM job_list LEFT JOIN results AS r USING (job_id) LEFT JOIN waypoints "
        "USING (job_id) WHERE experiment_id = " +
        std::to_string(experiment) + " ORDER BY initialization, problem_id, repetition, waypoint");
  }

  test::TemporaryFolder folder_;
  std::string key_file_, listen_;
  std::optional<Deployment> deployment_;
};

TEST_F(BridgeServiceTest, WhatIsSolvedOverTheLinkHasTheBitsOfWhatIsSolvedHere) {
  deployment_->StartServer();
  const std::vector<std::string> pool = {"--slots", "2", "--dataset", DefaultDataset().string()};
  auto here = deployment_->StartWorker("legopt-worker", pool);
  const std::int64_t local = deployment_->Submit(PostureSpec(1), "local");
  ASSERT_TRUE(deployment_->WaitUntilDone(local));
  here->Stop(kPatience);
  const auto there = StartBridged("legopt-worker", pool);
  const std::int64_t bridged = deployment_->Submit(PostureSpec(1), "bridged");
  ASSERT_TRUE(deployment_->WaitUntilDone(bridged)) << there->ErrorTail();
  EXPECT_GT(Solutions(local).size(), 10U);
  EXPECT_EQ(Solutions(bridged), Solutions(local));
  const std::string repeated = "SELECT count(*) FROM attempts WHERE attempt > 1";
  EXPECT_EQ(deployment_->Query(repeated), std::vector<std::string>{"0"});
}

TEST_F(BridgeServiceTest, RestartsOfTheHubUnderLoadLoseAndDoubleNothing) {
  deployment_->StartServer();
  const auto first = StartBridgedStub();
  const auto second = StartBridgedStub();
  constexpr int kJobs = 200;
  const std::int64_t experiment = deployment_->Submit(StubSpec(kJobs, 40), "a");
  for (int part = 1; part <= 3; ++part) {
    ASSERT_TRUE(deployment_->WaitForJobs(experiment, kJobs * part / 5));
    deployment_->KillServer();
    deployment_->StartServer();
  }
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(deployment_->Query("SELECT count(*), count(DISTINCT job_id) FROM results"),
            std::vector<std::string>{std::to_string(kJobs) + "|" + std::to_string(kJobs)});
  EXPECT_EQ(deployment_->Query("SELECT count(*) FROM jobs WHERE state <> 'done'"), std::vector<std::string>{"0"});
}

TEST_F(BridgeServiceTest, AClientCrossesTheLink) {
  deployment_->StartServer();
  const auto worker = StartBridgedStub();
  const std::int64_t experiment = deployment_->Submit(StubSpec(20, 1), "a");
  const auto ask = [this](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--access", access()});
    return std::make_unique<client::ChildProcess>(Program("legopt"), arguments, true);
  };
  const auto watch = ask({"watch", std::to_string(experiment)});
  const auto end = watch->Wait(kPatience);
  ASSERT_TRUE(end.has_value());
  EXPECT_EQ(end->code, 0) << watch->ErrorTail();
  std::ofstream(access()) << "legopt-access 1\ndeployment 5\naddress 127.0.0.1:9\n";
  ExpectEnd(*ask({"status", "--timeout", "0.2"}), ExitCode::kUnreachable, "127.0.0.1:9");
}

TEST_F(BridgeServiceTest, ABridgedWorkerHasANetworkOfItsOwn) {
  deployment_->StartServer();
  const auto worker = StartBridgedStub();
  const bool own = worker->WaitForLine("in a network namespace of its own", kPatience / 10);
  if (!own) GTEST_SKIP() << "NO NETWORK NAMESPACE TO BE HAD HERE: the private bus is not tested";
  const auto network_of = [](const std::string& process) {
    return std::filesystem::read_symlink("/proc/" + process + "/ns/net").string();
  };
  EXPECT_NE(network_of(std::to_string(worker->pid())), network_of("self"));
  ASSERT_TRUE(deployment_->WaitForWorkers(1));
  EXPECT_EQ(worker->Stop(kPatience).code, 0) << worker->ErrorTail();
}

TEST_F(BridgeServiceTest, WithoutANamespaceItsBusIsAFreePairOfPorts) {
  deployment_->StartServer();
  const std::string command = "echo 0 > /proc/sys/user/max_net_namespaces && exec " + Program("stub_worker").string() +
                              " --slots 1 --dataset stub-d --access " + access();
  client::ChildProcess worker("/usr/bin/unshare", {"--user", "--map-root-user", "sh", "-c", command}, true);
  if (!worker.WaitForLine("LCM stays on ports", kPatience / 10)) {
    GTEST_SKIP() << "NO USER NAMESPACE IN WHICH TO FORBID NETWORKS: " << worker.ErrorTail();
  }
  EXPECT_TRUE(deployment_->WaitForWorkers(1));
}

TEST_F(BridgeServiceTest, TheAccessFileIsTheOwnersAndHoldsNoKey) {
  deployment_->StartServer();
  struct stat status {};
  ASSERT_EQ(::stat(access().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  std::ifstream file(access()), key(key_file_);
  const std::string text{std::istreambuf_iterator<char>(file), {}}, secret{std::istreambuf_iterator<char>(key), {}};
  EXPECT_NE(text.find("address " + listen_), std::string::npos) << text;
  EXPECT_EQ(text.find(secret.substr(0, 16)), std::string::npos);
}

TEST_F(BridgeServiceTest, AServerThatCannotBeReachedIsToldWithAllAddressesThatWereTried) {
  std::ofstream(access()) << "legopt-access 1\ndeployment 5\naddress 127.0.0.1:9\naddress 127.1.2.3:9\n";
  const auto worker = StartBridged("stub_worker", {"--slots", "1", "--dataset", "stub-d", "--wait-server", "0.5"});
  ExpectEnd(*worker, ExitCode::kUnreachable, "127.0.0.1:9, 127.1.2.3:9");
  EXPECT_NE(worker->ErrorTail().find("--listen"), std::string::npos) << worker->ErrorTail();
}

TEST_F(BridgeServiceTest, AWorkerWithAnotherKeyIsToldWhatMayBeWrong) {
  deployment_->StartServer();
  const std::string other = (folder_ / "other").string();
  bus::MessageKey::Random()->WriteFile(other);
  const auto worker =
      StartBridged("stub_worker", {"--slots", "1", "--dataset", "stub-d", "--wait-server", "0.5", "--key-file", other});
  ExpectEnd(*worker, ExitCode::kUnreachable, "with the key in " + other);
}

TEST_F(BridgeServiceTest, ABadAccessFileIsRefused) {
  const auto expect = [this](const std::string& text, const std::string& word) {
    std::ofstream(access()) << text;
    const auto worker = StartBridged("stub_worker", {"--slots", "1", "--dataset", "stub-d"});
    ExpectEnd(*worker, ExitCode::kUsage, word);
  };
  expect("", "not an access file");
  expect("legopt-access 1\naddress 127.0.0.1:9\n", "no deployment");
  expect("legopt-access 1\ndeployment 5\n", "no address");
  expect("legopt-access 1\ndeployment 5\naddress localhost:9\n", "line 3");
  expect("legopt-access 1\ndeployment 5\nkey 00\n", "unknown word 'key'");
}

TEST_F(BridgeServiceTest, AServerThatMayNotListenLeavesNoDatabase) {
  const bridge::LinkSocket taken(bridge::ParseLinkAddress(listen_));
  ExpectServerEnd({"--listen", listen_}, ExitCode::kNetworkUnusable, "cannot be taken");
  ExpectServerEnd({"--listen", "here"}, ExitCode::kUsage, "ADDRESS:PORT");
  ExpectServerEnd({"--access", access()}, ExitCode::kUsage, "--listen");
  unsetenv(kKeyOfTheEnvironment);
  ExpectServerEnd({"--listen", "7669"}, ExitCode::kUsage, "legopt service keygen");
}

}  // namespace
}  // namespace legopt::service
