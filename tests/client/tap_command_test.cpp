// Policy: `legopt service tap` listens to a deployment without taking part, prints one JSON object per line and nothing
// else on standard output, and reports if no traffic was received.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "bus/message_key.h"
#include "program_run.h"
#include "test_database.h"

namespace legopt::client {
namespace {

using testing::HasSubstr;
using Environment = std::map<std::string, std::string>;

constexpr char kListening[] = "listening";

std::vector<nlohmann::json> Lines(const std::string& text) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

// Returns the output up to the last complete line.
std::string WholeLines(const std::string& text) { return text.substr(0, text.rfind('\n') + 1); }

std::optional<nlohmann::json> FirstRequest(const std::string& text) {
  for (const auto& line : Lines(WholeLines(text))) {
    if (line.at("kind") == "request") return line;
  }
  return std::nullopt;
}

// Returns whether the answer to the recorded request is shown. A busy machine may still deliver an answer to an
// earlier call.
bool ShowsItsAnswer(const std::string& text) {
  const auto request = FirstRequest(text);
  if (!request) return false;
  for (const auto& line : Lines(WholeLines(text))) {
    const bool answer = line.at("sender") == 1 && (line.contains("body") || line.contains("chunk"));
    if (answer && line.at("call_id") == request->at("call_id") && line.at("destination") == request->at("sender")) {
      return true;
    }
  }
  return false;
}

class TapCommand : public testing::Test {
 protected:
  void SetUp() override {
    if (!bus::ProbeMulticastRoute(bus::LcmOptions{}.group).usable) GTEST_SKIP() << "no multicast route here";
    port_ = std::to_string(bus::FindFreePortPair(bus::RandomSeed()));
  }

  // Starts a server and waits until `status` gets an answer.
  void StartServer(const Environment& environment = {}) {
    server_.emplace(BuiltProgram("legopt-server"),
                    std::vector<std::string>{"--db", (folder_.path() / "tap.sqlite").string(), "--port", port_},
                    folder_.path(), environment);
    ASSERT_EQ(Status(environment), 0);
  }
  int Status(const Environment& environment = {}) {
    return RunLegopt({"status", "--port", port_, "--timeout", "30"}, folder_.path(), environment).exit_code;
  }
  std::vector<std::string> Arguments(std::vector<std::string> more) {
    more.insert(more.begin(), {"service", "tap", "--port", port_});
    return more;
  }
  // Taps while one `legopt status` runs (a probe and a status call) until the output is enough, then interrupts it.
  ProgramResult TapOneStatus(std::vector<std::string> arguments, const std::function<bool(const std::string&)>& enough,
                             const Environment& environment = {}) {
    RunningProgram tap(BuiltProgram("legopt"), Arguments(std::move(arguments)), folder_.path(), environment);
    EXPECT_TRUE(tap.WaitForError(kListening));
    EXPECT_EQ(Status(server_environment_), 0);
    EXPECT_TRUE(tap.WaitForOutput(enough));
    kill(tap.pid(), SIGINT);
    return tap.Wait();
  }

  TemporaryFolder folder_;
  std::string port_;
  Environment server_environment_;
  std::optional<RunningProgram> server_;
};

TEST_F(TapCommand, ShowsACallFromRequestToReply) {
  StartServer();
  const auto result = TapOneStatus({"--type", "status"}, ShowsItsAnswer);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto request = FirstRequest(result.out);
  ASSERT_TRUE(request) << result.out;
  EXPECT_EQ(request->at("destination"), 1);
  EXPECT_EQ(request->at("body"), (nlohmann::json{{"experiment_id", 0}}));
  EXPECT_EQ(request->at("tag"), "unsigned");
  for (const auto& line : Lines(result.out)) EXPECT_EQ(line.at("type"), "status");
  EXPECT_THAT(result.err, HasSubstr("heard"));
}

// Traffic that arrived before an interrupt during the tap's sleep is shown.
TEST_F(TapCommand, AnInterruptLosesNothingThatHasPassed) {
  StartServer();
  RunningProgram tap(BuiltProgram("legopt"), Arguments({"--type", "status"}), folder_.path());
  ASSERT_TRUE(tap.WaitForError(kListening));
  ASSERT_EQ(kill(tap.pid(), SIGSTOP), 0);
  EXPECT_EQ(Status(), 0);
  kill(tap.pid(), SIGINT);
  kill(tap.pid(), SIGCONT);
  const auto result = tap.Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_TRUE(ShowsItsAnswer(result.out)) << result.out << result.err;
}

TEST_F(TapCommand, FiltersBySenderAndEndsAfterACount) {
  StartServer();
  RunningProgram tap(BuiltProgram("legopt"), Arguments({"--from", "server", "--count", "1"}), folder_.path());
  ASSERT_TRUE(tap.WaitForError(kListening));
  ASSERT_EQ(Status(), 0);
  const auto result = tap.Wait();
  EXPECT_EQ(result.exit_code, 0) << result.err;
  const auto lines = Lines(result.out);
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0].at("sender"), 1);
}

TEST_F(TapCommand, AKeyIsCheckedAndNeverShown) {
  const std::string file = (folder_.path() / "key").string();
  bus::MessageKey::Random()->WriteFile(file);
  server_environment_ = {{"LEGOPT_KEY_FILE", file}};
  StartServer(server_environment_);
  const auto with = TapOneStatus({}, ShowsItsAnswer, server_environment_);
  ASSERT_EQ(with.exit_code, 0) << with.err;
  for (const auto& line : Lines(with.out)) EXPECT_EQ(line.at("tag"), "signed") << line;
  std::ifstream stream(file);
  std::string secret;
  stream >> secret;
  EXPECT_EQ((with.out + with.err).find(secret), std::string::npos);
  const auto without = TapOneStatus({}, [](const std::string& text) { return !WholeLines(text).empty(); });
  for (const auto& line : Lines(without.out)) {
    EXPECT_EQ(line.at("tag"), "wrong") << line;
    EXPECT_FALSE(line.contains("body"));
  }
  EXPECT_THAT(without.err, HasSubstr("--key-file"));
  const std::string worker_file = (folder_.path() / "worker.key").string();
  bus::MessageKey::Load(file)->ForRole(bus::KeyRole::kWorker)->WriteFile(worker_file);
  const auto of_a_worker =
      TapOneStatus({"--key-file", worker_file}, [](const std::string& text) { return !WholeLines(text).empty(); });
  EXPECT_THAT(of_a_worker.err, HasSubstr("a worker's key checks the tags of that role only; the full key checks all"));
}

TEST_F(TapCommand, SilenceIsSaid) {
  const auto result = RunLegopt(Arguments({"--seconds", "0.2"}), folder_.path());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr("nothing was heard at 239.255.76.67:" + port_));
}

// The server counts every received datagram: none comes from the tap.
TEST_F(TapCommand, NothingIsSent) {
  bus::LcmOptions network;
  network.port = std::stoi(port_);
  bus::LcmTransport ear(network);
  RunningProgram tap(BuiltProgram("legopt"), Arguments({"--seconds", "0.5"}), folder_.path());
  ASSERT_TRUE(tap.WaitForError(kListening));
  tap.Wait();
  while (ear.Poll({}, bus::microseconds(0)) > 0) {
  }
  EXPECT_EQ(ear.counters().datagrams_received, 0U);
}

TEST_F(TapCommand, WrongUsage) {
  EXPECT_THAT(RunLegopt(Arguments({"--type", "leas"}), folder_.path()).err, HasSubstr("did you mean 'lease'?"));
  for (const char* address : {"nobody", "0", "-4", "99999999999999999999"}) {
    const auto result = RunLegopt(Arguments({"--from", address}), folder_.path());
    EXPECT_EQ(result.exit_code, 2) << address;
  }
  EXPECT_EQ(RunLegopt(Arguments({"--count", "0"}), folder_.path()).exit_code, 2);
}

}  // namespace
}  // namespace legopt::client
