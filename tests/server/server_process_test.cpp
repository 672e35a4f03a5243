// The program legopt-server: the ready line, the clean end, and a distinct exit code for each cause of failure.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <fstream>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "bus/codec.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/typed_calls.h"
#include "db/connection.h"
#include "db/migrations.h"
#include "db/sqlite_store.h"
#include "tests/db/store_samples.h"
#include "tests/folders.h"
#include "tests/server/sample_spec.h"

namespace legopt::server {
namespace {

// A child process with its standard output and error in one pipe. Killed by the destructor if still running.
class Process {
 public:
  explicit Process(const std::vector<std::string>& arguments) {
    int ends[2];
    if (pipe(ends) != 0) std::abort();
    std::vector<char*> argv;
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(ends[1], STDOUT_FILENO);
      dup2(ends[1], STDERR_FILENO);
      close(ends[0]);
      close(ends[1]);
      execvp(argv[0], argv.data());
      _exit(127);
    }
    close(ends[1]);
    output_ = ends[0];
  }
  ~Process() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
    close(output_);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Reads until `word` has appeared; returns false if the output ends before.
  bool WaitFor(const std::string& word) {
    while (text_.find(word) == std::string::npos) {
      char buffer[512];
      const ssize_t size = read(output_, buffer, sizeof(buffer));
      if (size <= 0) return false;
      text_.append(buffer, static_cast<std::size_t>(size));
    }
    return true;
  }

  void Signal(int number) const { kill(pid_, number); }

  // Waits for the end; returns the exit code, or 1000 + signal.
  int Wait() {
    WaitFor("\1");  // reads to the end of the output
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
  }

  const std::string& text() const { return text_; }
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  std::string text_;
};

class ServerProcess : public testing::Test {
 protected:
  void SetUp() override {
    const bus::MulticastRoute route = bus::ProbeMulticastRoute(bus::LcmOptions{}.group);
    if (!route.usable) GTEST_SKIP() << route.problem;
    port_ = bus::FindFreePortPair(bus::RandomSeed());
  }

  std::vector<std::string> Command(const std::filesystem::path& database, int port) const {
    return {BuildFolder() + "/legopt-server", "--db", database.string(), "--port", std::to_string(port)};
  }

  void ExpectExit(const std::vector<std::string>& command, int code, const std::string& word) {
    Process process(command);
    EXPECT_EQ(process.Wait(), code) << process.text();
    EXPECT_NE(process.text().find(word), std::string::npos) << process.text();
  }

  // Sends the submission repeatedly until `enough`, called with whether an answer arrived, returns true.
  void SubmitWhile(const std::string& id, const std::function<bool(bool)>& enough) {
    bus::LcmOptions options;
    options.port = port_;
    bus::LcmTransport transport(options);
    bus::Endpoint client(transport, bus::RandomEndpointId(), bus::RandomSeed());
    legopt_msg::submit_request request{};
    request.submission_id = id;
    request.spec_json = SampleSpec().dump();
    bus::CallOptions call;
    call.timeout = std::chrono::minutes(1);
    bool answered = false;
    bus::CallMessage(client, bus::kServer, request, call,
                     [&](bus::CallOutcome<legopt_msg::submit_reply>&& outcome) { answered = outcome.ok(); });
    do {
      client.Poll(std::chrono::milliseconds(10));
    } while (!enough(answered));
  }
  void Submit(const std::string& id) {
    SubmitWhile(id, [](bool answered) { return answered; });
  }

  std::string StoreErrorInStatus() {
    bus::LcmOptions options;
    options.port = port_;
    bus::LcmTransport transport(options);
    bus::Endpoint client(transport, bus::RandomEndpointId(), bus::RandomSeed());
    std::optional<std::string> json;
    bus::CallOptions call;
    call.timeout = std::chrono::minutes(1);
    bus::CallMessage(client, bus::kServer, legopt_msg::status_request{}, call,
                     [&](bus::CallOutcome<legopt_msg::status_reply>&& outcome) { json = outcome.reply.json; });
    while (!json) client.Poll(std::chrono::milliseconds(10));
    return nlohmann::json::parse(*json).at("server").at("store_error").get<std::string>();
  }

  db::TemporaryFolder folder_;
  std::filesystem::path database_ = folder_ / "results.sqlite";
  int port_ = 0;
};

TEST_F(ServerProcess, SaysReadyAndStopsCleanly) {
  for (const int signal_number : {SIGTERM, SIGINT, SIGHUP}) {
    Process server(Command(database_, port_));
    ASSERT_TRUE(server.WaitFor("ready")) << server.text();
    server.Signal(signal_number);
    EXPECT_EQ(server.Wait(), 0) << server.text();
    EXPECT_FALSE(std::filesystem::exists(database_.string() + "-wal")) << "checkpointed";
    EXPECT_FALSE(std::filesystem::exists(database_.string() + ".lock"));
  }
}

TEST_F(ServerProcess, StartsAgainAfterKill9) {
  for (int i = 0; i < 3; ++i) {
    Process server(Command(database_, port_));
    ASSERT_TRUE(server.WaitFor("ready")) << server.text();
    server.Signal(SIGKILL);
    EXPECT_EQ(server.Wait(), 1000 + SIGKILL);
  }
}

TEST_F(ServerProcess, SecondServerOnTheDatabaseIsRefused) {
  Process first(Command(database_, port_));
  ASSERT_TRUE(first.WaitFor("ready")) << first.text();
  ExpectExit(Command(database_, bus::FindFreePortPair(bus::RandomSeed())), 6, "another legopt-server");
}

TEST_F(ServerProcess, SecondServerOnTheFileIsRefusedWhateverItsName) {
  Process first(Command(database_, port_));
  ASSERT_TRUE(first.WaitFor("ready")) << first.text();
  std::filesystem::create_symlink(database_, folder_ / "link.sqlite");
  std::filesystem::create_hard_link(database_, folder_ / "hard.sqlite");
  const int port = bus::FindFreePortPair(bus::RandomSeed());
  const std::string holder = "another legopt-server (process " + std::to_string(first.pid()) + " on ";
  ExpectExit(Command(folder_ / "link.sqlite", port), 6, holder);
  ExpectExit(Command(folder_ / "hard.sqlite", port), 6, holder);
}

// Mounted elsewhere, by file and by folder, in a mount namespace, if permitted.
TEST_F(ServerProcess, SecondServerOnABindMountIsRefused) {
  std::filesystem::create_directory(folder_ / "elsewhere");
  std::ofstream(folder_ / "mounted.sqlite").close();
  const std::string folder = folder_.path().string();
  const std::string mounts = "mount --bind " + folder + " " + folder + "/elsewhere && mount --bind " +
                             database_.string() + " " + folder + "/mounted.sqlite && ";
  Process first(Command(database_, port_));
  ASSERT_TRUE(first.WaitFor("ready")) << first.text();
  Process probe({"unshare", "-m", "sh", "-c", mounts + "true"});
  if (probe.Wait() != 0) GTEST_SKIP() << "no bind mounts here: " << probe.text();
  const int port = bus::FindFreePortPair(bus::RandomSeed());
  for (const std::string& name : {folder + "/elsewhere/results.sqlite", folder + "/mounted.sqlite"}) {
    std::string command = mounts + "exec";
    for (const std::string& word : Command(name, port)) command += " " + word;
    ExpectExit({"unshare", "-m", "sh", "-c", command}, 6, "another legopt-server");
  }
}

TEST_F(ServerProcess, ARenamedDatabaseIsNoticedAndSurvivesKill9) {
  const auto moved = folder_ / "moved.sqlite";
  {
    Process server(Command(database_, port_));
    ASSERT_TRUE(server.WaitFor("ready")) << server.text();
    Submit("first");
    std::filesystem::rename(database_, moved);
    ASSERT_TRUE(server.WaitFor("moved to")) << server.text();
    EXPECT_NE(StoreErrorInStatus().find("moved to"), std::string::npos);
    server.Signal(SIGKILL);
    server.Wait();
  }
  db::Connection connection(moved, db::Connection::Mode::kReadOnly);
  EXPECT_EQ(connection.QueryText("SELECT submission_id FROM experiments"), "first");
}

TEST_F(ServerProcess, AfterARenameNothingIsAcknowledgedUntilTheFileIsBack) {
  const auto moved = folder_ / "moved.sqlite";
  Process server(Command(database_, port_));
  ASSERT_TRUE(server.WaitFor("ready")) << server.text();
  std::filesystem::rename(database_, moved);
  ASSERT_TRUE(server.WaitFor("moved to")) << server.text();
  int answers = 0;
  SubmitWhile("late", [&](bool answered) {
    EXPECT_FALSE(answered);
    EXPECT_NE(StoreErrorInStatus(), "");  // answered after the submission was received
    return ++answers == 3;
  });
  std::filesystem::rename(moved, database_);
  Submit("late");
  ASSERT_TRUE(server.WaitFor("can be used again")) << server.text();
  server.Signal(SIGTERM);
  EXPECT_EQ(server.Wait(), 0) << server.text();
  db::Connection connection(database_, db::Connection::Mode::kReadOnly);
  EXPECT_EQ(connection.QueryInt("SELECT count(*) FROM experiments"), 1);
}

TEST_F(ServerProcess, ARemovedDatabaseIsRescued) {
  Process server(Command(database_, port_));
  ASSERT_TRUE(server.WaitFor("ready")) << server.text();
  Submit("first");
  std::filesystem::remove(database_);
  ASSERT_TRUE(server.WaitFor("was copied to ")) << server.text();
  server.Signal(SIGKILL);
  server.Wait();
  const std::string word = "was copied to ";
  const auto begin = server.text().find(word) + word.size();
  db::Connection connection(server.text().substr(begin, server.text().find(';', begin) - begin),
                            db::Connection::Mode::kReadOnly);
  EXPECT_EQ(connection.QueryText("SELECT submission_id FROM experiments"), "first");
}

TEST_F(ServerProcess, SecondServerOnThePortIsRefused) {
  Process first(Command(database_, port_));
  ASSERT_TRUE(first.WaitFor("ready")) << first.text();
  ExpectExit(Command(folder_ / "other.sqlite", port_), 7, database_.string());
}

TEST_F(ServerProcess, OfServersStartedTogetherExactlyOneServes) {
  constexpr int kRounds = 10;
  constexpr int kServers = 2;
  for (int round = 0; round < kRounds; ++round) {
    const int port = bus::FindFreePortPair(bus::RandomSeed());
    std::vector<std::unique_ptr<Process>> servers;
    for (int i = 0; i < kServers; ++i) {
      servers.push_back(std::make_unique<Process>(Command(folder_ / (std::to_string(i) + ".sqlite"), port)));
    }
    int ready = 0;
    for (const auto& server : servers) {
      if (server->WaitFor("ready")) {
        ++ready;
      } else {
        EXPECT_EQ(server->Wait(), 7) << server->text();
        EXPECT_NE(server->text().find("--port"), std::string::npos) << server->text();
      }
    }
    EXPECT_EQ(ready, 1) << "round " << round;
  }
}

TEST_F(ServerProcess, AnotherDeploymentOnAPortIsRefused) {
  Process first(Command(database_, port_));
  ASSERT_TRUE(first.WaitFor("ready")) << first.text();
  const auto other = folder_ / "other.sqlite";
  for (const int port : {port_ - 1, port_ + 1}) ExpectExit(Command(other, port), 7, "choose another --port");
  std::vector<std::string> other_group = Command(other, port_);
  other_group.insert(other_group.end(), {"--group", "239.255.76.99"});
  ExpectExit(other_group, 7, "choose another --port");
  EXPECT_FALSE(std::filesystem::exists(other)) << "a server that may not serve leaves no database behind";
}

TEST_F(ServerProcess, FramesOfAnotherDeploymentKeepItFromServing) {
  bus::LcmOptions options;
  options.port = port_;
  options.deployment = 4711;
  bus::LcmTransport transport(options);
  bus::Endpoint stranger(transport, bus::RandomEndpointId(), bus::RandomSeed());
  bus::CallOptions call;
  call.timeout = std::chrono::minutes(1);
  call.max_retry = call.first_retry = std::chrono::milliseconds(20);
  stranger.Call(bus::kServer, bus::MessageType::kProbe, bus::Encode(legopt_msg::probe_request{}), call, {});
  std::atomic<bool> done = false;
  std::thread talk([&] {
    while (!done) stranger.Poll(std::chrono::milliseconds(10));
  });
  ExpectExit(Command(database_, port_), 7, "another deployment");
  done = true;
  talk.join();
  EXPECT_FALSE(std::filesystem::exists(database_));
}

TEST_F(ServerProcess, UnusableDatabasesHaveTheirExitCode) {
  ExpectExit(Command(folder_ / "no" / "results.sqlite", port_), 6, "folder");
  std::ofstream(folder_ / "text.sqlite") << std::string(5000, 'x');
  ExpectExit(Command(folder_ / "text.sqlite", port_), 6, "not a SQLite file");
  std::filesystem::create_directory(folder_ / "folder.sqlite");
  for (const std::filesystem::path& no_file : {std::filesystem::path("/dev/null"), folder_ / "folder.sqlite"}) {
    ExpectExit(Command(no_file, port_), 6, "is not a file");
    EXPECT_FALSE(std::filesystem::exists(no_file.string() + ".lock"));
  }
  { db::OpenSqliteStore(database_); }
  {
    db::Connection connection(database_, db::Connection::Mode::kReadWriteCreate);
    connection.Execute("PRAGMA user_version = " + std::to_string(db::SchemaVersion() + 1));
  }
  ExpectExit(Command(database_, port_), 9, "newer legopt");
}

TEST_F(ServerProcess, AnAlteredSchemaIsAnUnusableDatabase) {
  { db::OpenSqliteStore(database_); }
  {
    db::Connection connection(database_, db::Connection::Mode::kReadWriteCreate);
    connection.Execute("DROP TABLE waypoints");
  }
  ExpectExit(Command(database_, port_), 6, "not an intact legopt database: table 'waypoints' is missing");
}

TEST_F(ServerProcess, WrongUsageHasItsExitCode) {
  ExpectExit({BuildFolder() + "/legopt-server"}, 2, "--db");
  std::vector<std::string> command = Command(database_, port_);
  command.insert(command.end(), {"--group", "10.1.2.3"});
  ExpectExit(command, 2, "multicast");
}

TEST_F(ServerProcess, MissingMulticastRouteHasItsExitCode) {
  // Root needs no user namespace, and cannot create one in a chroot.
  for (const char* options : {"-n", "-rn"}) {
    Process probe({"unshare", options, "true"});
    if (probe.Wait() != 0) continue;
    std::vector<std::string> command = Command(database_, port_);
    command.insert(command.begin(), {"unshare", options});
    return ExpectExit(command, 7, "ip route add");
  }
  GTEST_SKIP() << "NOT TESTED: 'unshare -n' and 'unshare -rn' are refused here";
}

}  // namespace
}  // namespace legopt::server
