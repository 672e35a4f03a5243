// Real processes with a shared key: authorized programs work, even across restarts of the server, and others get an
// error that names the missing key. No program sends to other hosts or starts with a bad key by accident.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <optional>

#include "app/exit_codes.h"
#include "bus/message_key.h"
#include "client/client_error.h"
#include "tests/service/deployment.h"
#include "tests/temporary_folder.h"

namespace legopt::service {
namespace {

using app::ExitCode;

constexpr char kKeyVariable[] = "LEGOPT_KEY_FILE";
constexpr std::chrono::milliseconds kEndPatience{20'000};

class KeyTest : public testing::Test {
 protected:
  void SetUp() override {
    if (const std::string why = Deployment::Unavailable(); !why.empty()) GTEST_SKIP() << "NO MULTICAST HERE: " << why;
    key_file_ = (folder_ / "key").string();
    bus::MessageKey::Random()->WriteFile(key_file_);
  }
  void TearDown() override {
    deployment_.reset();
    unsetenv(kKeyVariable);
  }

  void UseKey() { setenv(kKeyVariable, key_file_.c_str(), 1); }
  void Start() {
    deployment_.emplace();
    deployment_->StartServer();
  }
  client::NetworkOptions Network() const {
    client::NetworkOptions network;
    network.port = deployment_->port();
    network.timeout_s = 30;
    return network;
  }
  // Starts a server with further arguments and expects that it gives up.
  void ExpectRefusal(const std::vector<std::string>& arguments, const std::string& word) {
    std::vector<std::string> all = {"--db", (folder_ / "refused.sqlite").string()};
    all.insert(all.end(), arguments.begin(), arguments.end());
    client::ChildProcess server(Program("legopt-server"), all, true);
    const auto exit = server.Wait(kEndPatience);
    ASSERT_TRUE(exit.has_value());
    EXPECT_EQ(exit->code, StatusOf(ExitCode::kUsage)) << server.ErrorTail();
    EXPECT_NE(server.ErrorTail().find(word), std::string::npos) << server.ErrorTail();
    EXPECT_FALSE(std::filesystem::exists(folder_ / "refused.sqlite"));
  }

  test::TemporaryFolder folder_;
  std::string key_file_;
  std::optional<Deployment> deployment_;
};

TEST_F(KeyTest, WorkGoesThroughOverRestartsOfTheServer) {
  UseKey();
  Start();
  const auto worker = deployment_->StartStubWorker({"--slots", "2"});
  constexpr int kJobs = 60;
  const std::int64_t experiment = deployment_->Submit(StubSpec(kJobs, 10), "a");
  ASSERT_TRUE(deployment_->WaitForJobs(experiment, kJobs / 3));
  deployment_->KillServer();
  deployment_->StartServer();
  ASSERT_TRUE(deployment_->WaitUntilDone(experiment));
  EXPECT_EQ(deployment_->Query("SELECT count(*) FROM results"), std::vector<std::string>{std::to_string(kJobs)});
  EXPECT_EQ(deployment_->server().ErrorTail().find("no key"), std::string::npos);
}

// With the worker's key in the worker and the client's in the client, the experiment is solved, and each call outside
// of the role is refused.
TEST_F(KeyTest, RolesDoTheirWorkAndNothingElse) {
  const auto full = bus::MessageKey::Load(key_file_);
  const std::string worker_key = (folder_ / "worker.key").string(), client_key = (folder_ / "client.key").string();
  full->ForRole(bus::KeyRole::kWorker)->WriteFile(worker_key);
  full->ForRole(bus::KeyRole::kClient)->WriteFile(client_key);
  UseKey();
  Start();
  const auto worker = deployment_->StartStubWorker({"--slots", "2", "--key-file", worker_key});
  const auto run = [&](const std::string& key, std::vector<std::string> words) {
    words.insert(words.end(), {"--key-file", key, "--port", std::to_string(deployment_->port()), "--timeout", "30"});
    auto program = std::make_unique<client::ChildProcess>(Program("legopt"), words, true);
    const auto exit = program->Wait(kEndPatience);
    return std::pair(exit ? exit->code : -1, program->ErrorTail());
  };
  const auto connection = [&](const std::string& key) {
    client::NetworkOptions network = Network();
    network.key_file = key;
    return std::make_unique<client::ServerConnection>(network);
  };
  constexpr int kJobs = 20;
  const auto client = connection(client_key);
  EXPECT_EQ(client->Submit("a", StubSpec(kJobs, 10).dump(), {}).num_jobs, kJobs);
  ASSERT_TRUE(deployment_->WaitUntilDone(1));
  EXPECT_NE(client->Query("SELECT count(*) FROM results", 1, 10).find(std::to_string(kJobs)), std::string::npos);

  const int refused = StatusOf(ExitCode::kNotPermitted);
  const auto expect_refused = [&](const std::string& key, const std::vector<std::string>& words,
                                  const std::string& why) {
    const auto [code, error] = run(key, words);
    EXPECT_EQ(code, refused) << words[0] << ": " << error;
    EXPECT_NE(error.find(why), std::string::npos) << words[0] << ": " << error;
  };
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"cancel", "1"},
                                             {"pause", "1"},
                                             {"edit", "1", "--tag", "x"},
                                             {"service", "delete", "1", "--yes"},
                                             {"query", "SELECT 1"},
                                             {"service", "drain", "1"}}) {
    expect_refused(worker_key, words, "a worker's key does not permit");
  }
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"service", "delete", "1", "--yes"},
                                             {"pause", "1", "--now"},
                                             {"edit", "1", "--priority", "5"},
                                             {"service", "drain", "1"}}) {
    expect_refused(client_key, words, "give --key-file the full key");
  }
  EXPECT_EQ(run(client_key, {"edit", "1", "--tag", "kept"}).first, 0);
  EXPECT_EQ(run(worker_key, {"status"}).first, 0);
  EXPECT_EQ(deployment_->Query("SELECT tags FROM experiment_list"), std::vector<std::string>{"kept"});

  const auto stranger = deployment_->StartStubWorker({"--slots", "1", "--key-file", client_key});
  const auto exit = stranger->Wait(kEndPatience);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->code, refused) << stranger->ErrorTail();
  EXPECT_NE(stranger->ErrorTail().find("a client's key does not permit hello"), std::string::npos)
      << stranger->ErrorTail();
  ExpectRefusal({"--key-file", worker_key}, "holds a worker's key; a server needs the full key");
  EXPECT_EQ(run(key_file_, {"service", "delete", "1", "--yes"}).first, 0) << "the full key still does everything";
}

TEST_F(KeyTest, WhoeverHasNoKeyIsToldSo) {
  UseKey();
  Start();
  unsetenv(kKeyVariable);
  client::ServerConnection stranger(Network());
  try {
    stranger.Probe();
    ADD_FAILURE() << "answered";
  } catch (const client::ClientError& error) {
    EXPECT_NE(std::string(error.what()).find("--key-file"), std::string::npos) << error.what();
  }
}

TEST_F(KeyTest, WhoeverHasAKeyAgainstAServerWithoutIsToldWhatMayBeWrong) {
  Start();
  UseKey();
  client::NetworkOptions network = Network();
  network.timeout_s = 1;
  client::ServerConnection stranger(network);
  try {
    stranger.Probe();
    ADD_FAILURE() << "answered";
  } catch (const client::ClientError& error) {
    EXPECT_EQ(error.code(), client::ExitCode::kUnreachable);
    EXPECT_NE(std::string(error.what()).find("key"), std::string::npos) << error.what();
  }
}

TEST_F(KeyTest, AWorkerWithAnotherKeyIsToldWhatMayBeWrong) {
  Start();
  UseKey();
  const auto worker = deployment_->StartStubWorker({"--slots", "1", "--wait-server", "0.3"});
  const auto exit = worker->Wait(kEndPatience);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kUnreachable));
  EXPECT_NE(worker->ErrorTail().find("with the key in " + key_file_), std::string::npos) << worker->ErrorTail();
}

TEST_F(KeyTest, WithoutAKeyTheStartSaysSoInOneLine) {
  Start();
  const std::string words = deployment_->server().ErrorTail();
  EXPECT_NE(words.find("no key"), std::string::npos) << words;
  EXPECT_EQ(words.find('\n'), std::string::npos) << "one line: " << words;
}

TEST_F(KeyTest, NothingLeavesTheHostWithoutAKeyUnlessToldSo) {
  Start();
  const std::string port = std::to_string(deployment_->port());
  ExpectRefusal({"--ttl", "1", "--port", port}, "--key-file");
  const auto worker = deployment_->StartStubWorker({"--slots", "1", "--ttl", "1"});
  const auto exit = worker->Wait(kEndPatience);
  ASSERT_TRUE(exit.has_value());
  EXPECT_EQ(exit->code, StatusOf(ExitCode::kUsage)) << worker->ErrorTail();
  client::NetworkOptions network = Network();
  network.ttl = 1;
  EXPECT_ANY_THROW(client::ServerConnection{network});
  network.trust_network = true;
  EXPECT_NO_THROW(client::ServerConnection(network).Probe());
}

TEST_F(KeyTest, ABadKeyFileIsNeverIgnored) {
  ::chmod(key_file_.c_str(), 0644);
  ExpectRefusal({"--key-file", key_file_}, "chmod 600");
  ExpectRefusal({"--key-file", (folder_ / "missing").string()}, "keygen");
  ExpectRefusal({"--key-file", folder_.path().string()}, "regular file");
}

}  // namespace
}  // namespace legopt::service
