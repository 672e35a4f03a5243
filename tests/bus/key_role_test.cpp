// Keys of roles: which calls each role may make, and that no role can send, answer or acknowledge in the name of
// another. PROTOCOL.md, section 11, "Roles".
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "bus/wire.h"
#include "tests/bus/test_bed.h"
#include "tests/doubles/simulated_network.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr EndpointId kRolesCaller = 1000;
constexpr std::int64_t kRolesDeployment = 1;
constexpr std::array<KeyRole, 3> kRoles = {KeyRole::kOperator, KeyRole::kWorker, KeyRole::kClient};

// The table of PROTOCOL.md, repeated so that a changed row of messages.def does not pass unnoticed.
const std::set<MessageType> kForWorkers = {MessageType::kProbe,  MessageType::kStatus,    MessageType::kHello,
                                           MessageType::kLease,  MessageType::kHeartbeat, MessageType::kResult,
                                           MessageType::kMethod, MessageType::kDataset};
const std::set<MessageType> kForClients = {MessageType::kProbe,       MessageType::kStatus, MessageType::kSubmit,
                                           MessageType::kQuery,       MessageType::kCancel, MessageType::kControl,
                                           MessageType::kStoreDataset};

bool IsListed(KeyRole role, MessageType type) {
  if (role == KeyRole::kWorker) return kForWorkers.contains(type);
  if (role == KeyRole::kClient) return kForClients.contains(type);
  return true;
}

std::vector<MessageType> AllTypes() {
  std::vector<MessageType> types;
  for (std::int16_t type = 1; type <= kLastMessageType; ++type) types.push_back(static_cast<MessageType>(type));
  return types;
}

std::shared_ptr<const MessageKey> KeyOf(KeyRole role) {
  const auto full = TestKey();
  return {full, full->ForRole(role)};
}

struct RoleParty {
  RoleParty(SimulatedNetwork& network, EndpointId id, std::uint64_t seed, std::shared_ptr<const MessageKey> key)
      : transport(network, kRolesDeployment, std::move(key)), endpoint(transport, id, seed) {}
  SimulatedTransport transport;
  Endpoint endpoint;
};

class KeyRoles : public testing::Test {
 protected:
  KeyRoles() {
    for (const MessageType type : AllTypes()) {
      server_.endpoint.Serve(type, [this](Request&& request, Responder responder) {
        handled_.push_back(request.role);
        responder.Reply("<" + request.body + ">");
      });
    }
    network_.SetTap([this](Port port, std::span<const std::uint8_t> bytes) {
      recorded_.emplace_back(port, Datagram(bytes.begin(), bytes.end()));
    });
  }

  std::unique_ptr<RoleParty> MakeCaller(KeyRole role, EndpointId id = kRolesCaller, std::uint64_t seed = 2) {
    return std::make_unique<RoleParty>(network_, id, seed, KeyOf(role));
  }

  CallResult Call(RoleParty& caller, MessageType type, const std::string& body, microseconds timeout = seconds(5)) {
    std::optional<CallResult> result;
    CallOptions options;
    options.timeout = timeout;
    caller.endpoint.Call(kServer, type, body, options, [&](CallResult&& r) { result = std::move(r); });
    const std::array<Endpoint*, 2> endpoints = {&server_.endpoint, &caller.endpoint};
    network_.Run(
        endpoints, [&] { return result.has_value(); }, timeout + seconds(1));
    return result.value_or(CallResult{});
  }

  // Returns the header of the newest frame of this kind sent by `from`.
  FrameHeader Newest(EndpointId from, FrameKind kind) const {
    for (auto entry = recorded_.rbegin(); entry != recorded_.rend(); ++entry) {
      FrameView frame;
      if (OpenFrame(entry->second, kRolesDeployment, kAnyDestination, frame, TestKey().get()) != FrameFault::kNone)
        continue;
      if (frame.header.sender == from && frame.header.kind == kind) return frame.header;
    }
    ADD_FAILURE() << "no such frame";
    return {};
  }

  void Inject(const FrameHeader& header, std::size_t payload_bytes, KeyRole role) {
    FrameHeader forged = header;
    forged.role = role;
    network_.Inject(Port::kControl, SealFrame(forged, payload_bytes, buffer_, TestKey().get()));
  }

  SimulatedNetwork network_{1};
  RoleParty server_{network_, kServer, 1, TestKey()};
  std::vector<KeyRole> handled_;
  std::vector<std::pair<Port, Datagram>> recorded_;
  DatagramBuffer buffer_{};
};

TEST_F(KeyRoles, EachCallIsOpenToTheRolesOfTheTableAndToNoOthers) {
  std::uint64_t refused = 0;
  for (const KeyRole role : kRoles) {
    const auto caller = MakeCaller(role);
    for (const MessageType type : AllTypes()) {
      for (const std::size_t bytes : {std::size_t{10}, std::size_t{5'000}}) {
        const std::string body(bytes, 'x');
        const std::string what = std::string(ToString(role)) + " " + std::string(ToString(type));
        handled_.clear();
        const CallResult result = Call(*caller, type, body);
        EXPECT_EQ(MayCall(role, type), IsListed(role, type)) << what;
        if (IsListed(role, type)) {
          EXPECT_EQ(result.body, "<" + body + ">") << what;
          EXPECT_EQ(handled_, std::vector<KeyRole>{role}) << what;
          continue;
        }
        EXPECT_EQ(result.status, CallResult::kRejected) << what;
        EXPECT_EQ(result.code, ErrorCode::kRoleRefused) << what;
        EXPECT_NE(
            result.error.find(std::string(ToString(role)) + "'s key does not permit " + std::string(ToString(type))),
            std::string::npos)
            << result.error;
        EXPECT_TRUE(handled_.empty()) << what;
        ++refused;
      }
    }
  }
  EXPECT_EQ(refused, 2U * (AllTypes().size() - kForWorkers.size() + AllTypes().size() - kForClients.size()));
  EXPECT_GE(server_.endpoint.counters().rejected_role, refused);
  EXPECT_EQ(server_.endpoint.counters().rejected_tag, 0U);
}

TEST_F(KeyRoles, TheBodyOfARefusedCallIsNotTaken) {
  const auto worker = MakeCaller(KeyRole::kWorker);
  const std::string body(8'000'000, 'x');
  EXPECT_EQ(Call(*worker, MessageType::kSubmit, body).code, ErrorCode::kRoleRefused);
  EXPECT_EQ(server_.endpoint.held_bytes(), 0U);
  EXPECT_LT(server_.endpoint.counters().bytes_received, 200'000U);
}

TEST_F(KeyRoles, WithoutAKeyEverybodyIsAnOperator) {
  SimulatedNetwork network(1);
  RoleParty server(network, kServer, 1, nullptr), caller(network, kRolesCaller, 2, nullptr);
  std::optional<KeyRole> role;
  server.endpoint.Serve(MessageType::kShutdown, [&](Request&& request, Responder responder) {
    role = request.role;
    responder.Reply("");
  });
  caller.endpoint.Call(kServer, MessageType::kShutdown, "", {}, {});
  const std::array<Endpoint*, 2> endpoints = {&server.endpoint, &caller.endpoint};
  network.Run(
      endpoints, [&] { return role.has_value(); }, seconds(5));
  EXPECT_EQ(role, KeyRole::kOperator);
}

// A host of a pool overhears a client's call and answers before the server does.
TEST_F(KeyRoles, AWorkersKeyDoesNotAnswerInTheServersPlace) {
  for (const KeyRole role : {KeyRole::kClient, KeyRole::kOperator}) {
    const auto client = MakeCaller(role, kRolesCaller, 3);
    std::optional<CallResult> result;
    client->endpoint.Call(kServer, MessageType::kSubmit, "x", {}, [&](CallResult&& r) { result = std::move(r); });
    FrameHeader forged = Newest(kRolesCaller, FrameKind::kRequest);
    std::swap(forged.sender, forged.destination);
    forged.completed_below = 0;
    const auto rejected = client->endpoint.counters().rejected_tag;
    for (const FrameKind kind : {FrameKind::kReply, FrameKind::kError}) {
      forged.kind = kind;
      forged.code = kind == FrameKind::kError ? static_cast<std::int16_t>(ErrorCode::kMalformed) : std::int16_t{0};
      Inject(forged, 0, KeyRole::kWorker);
      client->endpoint.Poll(microseconds(0));
    }
    EXPECT_FALSE(result.has_value());
    EXPECT_EQ(client->endpoint.counters().rejected_tag, rejected + 2);
    const std::array<Endpoint*, 2> endpoints = {&server_.endpoint, &client->endpoint};
    network_.Run(
        endpoints, [&] { return result.has_value(); }, seconds(5));
    EXPECT_EQ(result->body, "<x>");
  }
}

// The attacker uses the client's own address, session and call numbers.
TEST_F(KeyRoles, AWorkersKeyDoesNotReachTheSessionOfAClient) {
  const auto client = MakeCaller(KeyRole::kClient);
  ASSERT_EQ(Call(*client, MessageType::kSubmit, "a").body, "<a>");
  FrameHeader proof = Newest(kRolesCaller, FrameKind::kProof);
  FrameHeader request = Newest(kRolesCaller, FrameKind::kRequest);
  const FrameHeader challenge = Newest(kServer, FrameKind::kError);
  ASSERT_EQ(challenge.code, static_cast<std::int16_t>(ErrorCode::kProveSession));
  // The session of the worker's key has to prove itself, although the client's session has done so.
  request.type = static_cast<std::int16_t>(MessageType::kProbe);
  request.call_id = request.completed_below = 1'000;
  request.nonce = 5'000;
  const auto challenged = server_.endpoint.counters().requests_challenged;
  Inject(request, 0, KeyRole::kWorker);
  server_.endpoint.Poll(microseconds(0));
  EXPECT_EQ(server_.endpoint.counters().requests_challenged, challenged + 1);
  // After its proof the worker's session makes calls of its own. The client's calls are neither finished nor answered
  // by them, and its nonces stay unused.
  const auto& recorded = *std::find_if(recorded_.begin(), recorded_.end(), [&](const auto& entry) {
    FrameView frame;
    return OpenFrame(entry.second, kRolesDeployment, kAnyDestination, frame, TestKey().get()) == FrameFault::kNone &&
           frame.header.kind == FrameKind::kProof;
  });
  std::copy(recorded.second.begin() + kFrameHeaderBytes, recorded.second.end(), buffer_.begin() + kFrameHeaderBytes);
  proof.nonce = 5'001;
  Inject(proof, kChallengeBytes, KeyRole::kWorker);
  request.nonce = 5'002;
  handled_.clear();
  Inject(request, 0, KeyRole::kWorker);
  server_.endpoint.Poll(microseconds(0));
  EXPECT_EQ(handled_, std::vector<KeyRole>{KeyRole::kWorker});
  EXPECT_EQ(Call(*client, MessageType::kSubmit, "b").body, "<b>");
  EXPECT_EQ(server_.endpoint.counters().rejected_replay, 0U);
}

TEST_F(KeyRoles, NoTagIsMadeOrTakenForARoleThatDoesNotFollow) {
  const auto worker = KeyOf(KeyRole::kWorker);
  EXPECT_EQ(worker->ForRole(KeyRole::kWorker), worker.get());
  EXPECT_EQ(worker->ForRole(KeyRole::kOperator), nullptr);
  EXPECT_EQ(worker->ForRole(KeyRole::kClient), nullptr);
  FrameHeader header;
  header.kind = FrameKind::kRequest;
  header.type = 1;
  header.deployment = kRolesDeployment;
  header.sender = kRolesCaller;
  header.destination = kServer;
  header.session = header.call_id = header.nonce = 1;
  for (const KeyRole role : kRoles) {
    header.role = role;
    const auto datagram = SealFrame(header, 0, buffer_, TestKey().get());
    FrameView frame;
    ASSERT_EQ(OpenFrame(datagram, kRolesDeployment, kServer, frame, TestKey().get()), FrameFault::kNone);
    EXPECT_EQ(frame.header.role, role);
    EXPECT_EQ(OpenFrame(datagram, kRolesDeployment, kServer, frame, worker.get()),
              role == KeyRole::kWorker ? FrameFault::kNone : FrameFault::kTag);
  }
  EXPECT_DEATH(KeyOfRole(worker.get(), KeyRole::kClient), "no tag of a client from the key of a worker");
}

}  // namespace
}  // namespace legopt::bus
