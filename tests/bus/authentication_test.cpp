// With a key, no unsigned, wrongly signed or replayed frame reaches a handler, even if a party restarts in between,
// and honest calls succeed. PROTOCOL.md, section 11; acceptance figure 16.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bus/endpoint.h"
#include "bus/wire.h"
#include "tests/bus/test_bed.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr EndpointId kClient = 1000;
constexpr std::int64_t kDeployment = 1;

struct Party {
  Party(SimulatedNetwork& network, EndpointId id, std::uint64_t seed, std::shared_ptr<const MessageKey> key,
        const EndpointOptions& options = {})
      : transport(network, kDeployment, std::move(key)), endpoint(transport, id, seed, options) {}
  SimulatedTransport transport;
  Endpoint endpoint;
};

class Authentication : public testing::Test {
 protected:
  Authentication() {
    network_.SetTap([this](Port port, std::span<const std::uint8_t> bytes) {
      if (recording_) recorded_.emplace_back(port, Datagram(bytes.begin(), bytes.end()));
    });
  }

  std::unique_ptr<Party> MakeServer(std::uint64_t seed, std::shared_ptr<const MessageKey> key,
                                    const EndpointOptions& options = {}) {
    auto server = std::make_unique<Party>(network_, kServer, seed, std::move(key), options);
    server->endpoint.Serve(MessageType::kShutdown, [this](Request&& request, Responder responder) {
      ++handled_;
      responder.Reply("<" + request.body + ">");
    });
    return server;
  }

  CallResult Call(Party& client, Party& server, const std::string& body, microseconds timeout = seconds(5)) {
    std::optional<CallResult> result;
    CallOptions options;
    options.timeout = timeout;
    client.endpoint.Call(kServer, MessageType::kShutdown, body, options,
                         [&](CallResult&& r) { result = std::move(r); });
    Run(server, &client, [&] { return result.has_value(); });
    return result.value_or(CallResult{});
  }

  void Run(Party& server, Party* client, const std::function<bool()>& done, microseconds limit = seconds(30)) {
    std::vector<Endpoint*> endpoints = {&server.endpoint};
    if (client != nullptr) endpoints.push_back(&client->endpoint);
    network_.Run(endpoints, done, limit);
  }

  // Injects datagrams in small bursts and polls the server after each.
  void Inject(Party& server, const std::vector<std::pair<Port, Datagram>>& datagrams) {
    recording_ = false;
    for (const auto& [port, datagram] : datagrams) {
      network_.Inject(port, datagram);
      server.endpoint.Poll(microseconds(0));
    }
    recording_ = true;
  }

  SimulatedNetwork network_{1};
  std::vector<std::pair<Port, Datagram>> recorded_;
  bool recording_ = true;
  int handled_ = 0;
};

TEST_F(Authentication, HonestCallsGoThroughAtOnce) {
  const auto server = MakeServer(1, TestKey());
  Party client(network_, kClient, 2, TestKey());
  EXPECT_EQ(Call(client, *server, "a").body, "<a>");
  EXPECT_EQ(network_.now(), microseconds(0)) << "no time-out had to pass";
  EXPECT_EQ(Call(client, *server, "b").body, "<b>");
  EXPECT_EQ(server->endpoint.counters().requests_challenged, 1U) << "one proof per session";
  EXPECT_EQ(client.endpoint.counters().requests_retried, 0U);
  EXPECT_EQ(handled_, 2);
}

TEST_F(Authentication, LargeBodiesGoThrough) {
  const auto server = MakeServer(1, TestKey());
  Party client(network_, kClient, 2, TestKey());
  const std::string body(300'000, 'x');
  EXPECT_TRUE(Call(client, *server, body).body == "<" + body + ">");
  EXPECT_LT(network_.now(), milliseconds(500));
}

TEST_F(Authentication, AnotherKeyOrNoneIsNotHeard) {
  const auto server = MakeServer(1, TestKey());
  Party stranger(network_, kClient, 2, TestKey(9));
  EXPECT_EQ(Call(stranger, *server, "a", milliseconds(500)).status, CallResult::kTimeout);
  EXPECT_GT(server->endpoint.counters().rejected_tag, 0U);
  EXPECT_EQ(handled_, 0);
}

TEST_F(Authentication, ACallerWithoutAKeyIsToldThatItNeedsOne) {
  const auto server = MakeServer(1, TestKey());
  Party stranger(network_, kClient, 2, nullptr);
  const CallResult result = Call(stranger, *server, "a");
  EXPECT_EQ(result.status, CallResult::kRejected);
  EXPECT_EQ(result.code, ErrorCode::kKeyNeeded);
  EXPECT_NE(result.error.find("--key-file"), std::string::npos);
  EXPECT_EQ(server->endpoint.counters().rejected_unsigned, 1U);
  EXPECT_EQ(handled_, 0);
}

TEST_F(Authentication, AServerWithoutTheKeyIsNotBelieved) {
  const auto server = MakeServer(1, nullptr);
  Party client(network_, kClient, 2, TestKey());
  EXPECT_EQ(Call(client, *server, "a", milliseconds(500)).status, CallResult::kTimeout);
}

TEST_F(Authentication, AForgedHintDoesNotEndACallOfSomebodyWithTheKey) {
  const auto server = MakeServer(1, TestKey());
  Party client(network_, kClient, 2, TestKey());
  std::optional<CallResult> result;
  client.endpoint.Call(kServer, MessageType::kShutdown, "a", {}, [&](CallResult&& r) { result = std::move(r); });
  FrameView sent;
  ASSERT_EQ(OpenFrame(recorded_.back().second, kDeployment, kServer, sent, TestKey().get()), FrameFault::kNone);
  FrameHeader forged = sent.header;
  forged.kind = FrameKind::kError;
  forged.code = static_cast<std::int16_t>(ErrorCode::kKeyNeeded);
  forged.sender = kServer;
  forged.destination = kClient;
  forged.completed_below = 0;
  DatagramBuffer buffer{};
  network_.Inject(Port::kControl, SealFrame(forged, 0, buffer));
  Run(*server, &client, [&] { return result.has_value(); });
  EXPECT_EQ(result->status, CallResult::kOk);
  EXPECT_EQ(client.endpoint.counters().rejected_unsigned, 1U);
}

// Replays all recorded traffic, in order and backwards.
TEST_F(Authentication, RecordedTrafficIsRefusedWithinOneLife) {
  const auto server = MakeServer(1, TestKey());
  Party client(network_, kClient, 2, TestKey());
  for (int i = 0; i < 20; ++i) Call(client, *server, std::string(i < 18 ? 10 : 5000, 'x'));
  ASSERT_EQ(handled_, 20);
  auto recorded = recorded_;
  Inject(*server, recorded);
  std::reverse(recorded.begin(), recorded.end());
  Inject(*server, recorded);
  EXPECT_EQ(handled_, 20);
  EXPECT_GE(server->endpoint.counters().rejected_replay, 40U);
}

TEST_F(Authentication, RecordedTrafficIsRefusedAfterARestart) {
  auto server = MakeServer(1, TestKey());
  Party client(network_, kClient, 2, TestKey());
  Call(client, *server, "x");
  const auto recorded = recorded_;
  server = MakeServer(3, TestKey());
  Inject(*server, recorded);
  EXPECT_EQ(handled_, 1);
  // The honest caller continues in the same session, and its frames to the first server process stay unusable.
  EXPECT_EQ(Call(client, *server, "y").body, "<y>");
  Inject(*server, recorded);
  EXPECT_EQ(handled_, 2);
  EXPECT_GT(server->endpoint.counters().rejected_replay, 0U);
}

TEST_F(Authentication, RecordedTrafficOfAForgottenSessionIsRefused) {
  EndpointOptions options;
  options.max_peers = 2;
  const auto server = MakeServer(1, TestKey(), options);
  Party client(network_, kClient, 2, TestKey());
  Call(client, *server, "x");
  const auto recorded = recorded_;
  for (std::uint64_t i = 1; i <= 3; ++i) {
    Party other(network_, kClient + static_cast<EndpointId>(i), 10 + i, TestKey());
    Call(other, *server, "z");
  }
  ASSERT_EQ(handled_, 4);
  Inject(*server, recorded);
  EXPECT_EQ(handled_, 4);
  EXPECT_EQ(Call(client, *server, "y").body, "<y>");
}

TEST_F(Authentication, MoreSessionsThanAreRememberedStillGetTheirAnswers) {
  EndpointOptions options;
  options.max_peers = 2;
  const auto server = MakeServer(1, TestKey(), options);
  std::vector<std::unique_ptr<Party>> clients;
  std::vector<Endpoint*> endpoints = {&server->endpoint};
  int answered = 0;
  constexpr int kClients = 6;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(std::make_unique<Party>(network_, kClient + i, 20 + i, TestKey()));
    endpoints.push_back(&clients.back()->endpoint);
    clients.back()->endpoint.Call(kServer, MessageType::kShutdown, "x", {},
                                  [&](CallResult&& r) { answered += r.status == CallResult::kOk ? 1 : 0; });
  }
  EXPECT_TRUE(network_.Run(
      endpoints, [&] { return answered == kClients; }, seconds(10)));
}

// Acceptance figure 16.
TEST_F(Authentication, OfAHundredThousandForgedCommandsNoneIsAccepted) {
  const auto server = MakeServer(1, TestKey());
  Party client(network_, kClient, 2, TestKey());
  for (int i = 0; i < 10; ++i) Call(client, *server, "honest");
  ASSERT_EQ(handled_, 10);
  const auto recorded = recorded_;
  const std::uint64_t rejected_before = server->endpoint.counters().rejected();
  std::vector<Datagram> requests;
  for (const auto& [port, datagram] : recorded) {
    FrameView view;
    if (OpenFrame(datagram, kDeployment, kServer, view, TestKey().get()) == FrameFault::kNone) {
      requests.push_back(datagram);
    }
  }
  std::mt19937_64 random(5);
  std::uint64_t challenged = server->endpoint.counters().requests_challenged;
  recording_ = false;
  constexpr int kCommands = 100'000;
  const auto wrong_key = TestKey(77);
  for (int i = 0; i < kCommands; ++i) {
    const Datagram& honest = requests[random() % requests.size()];
    FrameView view;
    OpenFrame(honest, kDeployment, kServer, view, TestKey().get());
    FrameHeader header = view.header;
    header.kind = FrameKind::kRequest;
    header.call_id += static_cast<std::int64_t>(random() % 100);
    header.nonce += static_cast<std::int64_t>(random() % 100);
    DatagramBuffer buffer{};
    switch (i % 4) {
      case 0:  // unsigned
        network_.Inject(Port::kControl, SealFrame(header, 8, buffer));
        break;
      case 1:  // signed with another key
        network_.Inject(Port::kControl, SealFrame(header, 8, buffer, wrong_key.get()));
        break;
      case 2: {  // a genuine one, modified
        Datagram changed = honest;
        constexpr std::size_t kDestination = 32;
        std::size_t at = random() % changed.size();
        if (at >= kDestination && at < kDestination + 8) at = 0;  // another party's frame is no fault
        changed[at] = static_cast<std::uint8_t>(changed[at] ^ (1 + random() % 255));
        network_.Inject(Port::kControl, changed);
        break;
      }
      default:  // a genuine one, replayed
        network_.Inject(Port::kControl, honest);
    }
    server->endpoint.Poll(microseconds(0));
  }
  const Counters& counters = server->endpoint.counters();
  EXPECT_EQ(handled_, 10);
  EXPECT_EQ(counters.requests_challenged, challenged);
  // The proof among the recorded frames has been accepted before; everything else is refused and counted.
  const std::uint64_t refused = counters.rejected() - rejected_before;
  EXPECT_LE(refused, static_cast<std::uint64_t>(kCommands));
  EXPECT_GE(refused, static_cast<std::uint64_t>(kCommands) * 97 / 100);
  EXPECT_EQ(counters.rejected_unsigned, static_cast<std::uint64_t>(kCommands) / 4);
  EXPECT_EQ(Call(client, *server, "still there").body, "<still there>");
}

}  // namespace
}  // namespace legopt::bus
