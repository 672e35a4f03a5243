// Links of spokes with a derived key: the hub forwards only frames of their role, and a spoke accepts only frames made
// for it. PROTOCOL.md, sections 11 and 14.
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "bus/bridge/hub_and_spoke.h"
#include "bus/wire.h"
#include "tests/bus/bridge/joined_hosts.h"

namespace legopt::bridge {
namespace {

using bus::KeyRole;
using std::chrono::milliseconds;

constexpr std::int64_t kRoleDeployment = 4711;
constexpr LinkAddress kHubAt = 1000, kSpokeAt = 2000;
constexpr bus::EndpointId kWorkerParty = bus::EndpointId{1} << 40;

struct Sink final : Carrier {
  void ToBus(bus::Port /*port*/, std::span<const std::uint8_t> frame) override {
    heard.emplace_back(frame.begin(), frame.end());
  }
  void ToLink(LinkAddress /*to*/, std::span<const std::uint8_t> envelope) override {
    sent.emplace_back(envelope.begin(), envelope.end());
  }
  std::vector<Bytes> heard, sent;
};

class LinkRoles : public testing::Test {
 protected:
  const bus::MessageKey* KeyOf(KeyRole role) const { return full_->ForRole(role); }

  // Returns a request to the server, or the server's answer to it.
  Bytes Frame(KeyRole role, bool answer = false, bus::EndpointId party = kWorkerParty) {
    bus::FrameHeader header;
    header.kind = answer ? bus::FrameKind::kReply : bus::FrameKind::kRequest;
    header.type = 1;
    header.deployment = kRoleDeployment;
    header.sender = answer ? bus::kServer : party;
    header.destination = answer ? party : bus::kServer;
    header.session = header.call_id = header.nonce = 1;
    header.role = role;
    bus::DatagramBuffer buffer;
    const auto frame = bus::SealFrame(header, 0, buffer, full_.get());
    return {frame.begin(), frame.end()};
  }

  // Passes messages between hub and spoke until both are silent.
  void Exchange(Spoke& spoke, Sink& from_spoke) {
    while (!from_spoke.sent.empty() || !from_hub_.sent.empty()) {
      for (const Bytes& bytes : std::exchange(from_spoke.sent, {})) hub_.OnLink(kSpokeAt, bytes, now_);
      for (const Bytes& bytes : std::exchange(from_hub_.sent, {})) spoke.OnLink(kHubAt, bytes, now_);
    }
  }
  void Link(Spoke& spoke, Sink& sink) {
    for (int i = 0; i < 20 && !spoke.linked(); ++i) {
      now_ += milliseconds(500);
      spoke.Tick(now_);
      Exchange(spoke, sink);
    }
    ASSERT_TRUE(spoke.linked());
  }

  std::shared_ptr<const bus::MessageKey> full_ = BridgeTestKey();
  microseconds now_{0};
  Sink from_hub_, from_spoke_;
  Hub hub_{{kRoleDeployment, full_.get()}, 1, from_hub_};
};

TEST_F(LinkRoles, AWorkersKeyMakesALinkForItsOwnFrames) {
  Spoke spoke({kRoleDeployment, KeyOf(KeyRole::kWorker)}, {kHubAt}, 2, from_spoke_);
  Link(spoke, from_spoke_);
  spoke.OnBus(bus::Port::kControl, Frame(KeyRole::kWorker), now_);
  Exchange(spoke, from_spoke_);
  EXPECT_EQ(from_hub_.heard, std::vector<Bytes>{Frame(KeyRole::kWorker)});
  hub_.OnBus(bus::Port::kControl, Frame(KeyRole::kWorker, true), now_);
  Exchange(spoke, from_spoke_);
  EXPECT_EQ(from_spoke_.heard, std::vector<Bytes>{Frame(KeyRole::kWorker, true)});
  // Frames of other roles, made by a process on the spoke's host or on the hub's host.
  for (const KeyRole role : {KeyRole::kOperator, KeyRole::kClient}) {
    spoke.OnBus(bus::Port::kControl, Frame(role), now_);
    EXPECT_TRUE(from_spoke_.sent.empty()) << ToString(role);
    hub_.OnBus(bus::Port::kControl, Frame(role, true), now_);
    EXPECT_TRUE(from_hub_.sent.empty()) << ToString(role);
  }
  EXPECT_EQ(spoke.counters().rejected_tag, 2U);
  EXPECT_EQ(hub_.counters().rejected_direction, 2U);
}

TEST_F(LinkRoles, ASpokeWithTheFullKeyCarriesEveryRole) {
  Spoke spoke({kRoleDeployment, full_.get()}, {kHubAt}, 2, from_spoke_);
  Link(spoke, from_spoke_);
  bus::EndpointId party = kWorkerParty;
  for (const KeyRole role : {KeyRole::kOperator, KeyRole::kWorker, KeyRole::kClient}) {
    spoke.OnBus(bus::Port::kControl, Frame(role, false, ++party), now_);
    Exchange(spoke, from_spoke_);
    EXPECT_EQ(from_hub_.heard.back(), Frame(role, false, party)) << ToString(role);
    hub_.OnBus(bus::Port::kControl, Frame(role, true, party), now_);
    Exchange(spoke, from_spoke_);
    EXPECT_EQ(from_spoke_.heard.back(), Frame(role, true, party)) << ToString(role);
  }
}

// A host that has received a client's frame sends it, or its address, over its own link.
TEST_F(LinkRoles, AWorkersLinkDrawsNoRouteOfAnotherRole) {
  Sink from_client;
  Spoke client({kRoleDeployment, KeyOf(KeyRole::kClient)}, {kHubAt}, 3, from_client);
  Link(client, from_client);
  client.OnBus(bus::Port::kControl, Frame(KeyRole::kClient), now_);
  Exchange(client, from_client);
  ASSERT_EQ(from_hub_.heard.size(), 1U);

  Spoke worker({kRoleDeployment, KeyOf(KeyRole::kWorker)}, {kHubAt}, 2, from_spoke_);
  Link(worker, from_spoke_);
  worker.OnBus(bus::Port::kControl, Frame(KeyRole::kWorker), now_);  // with the client's address
  EXPECT_EQ(from_spoke_.sent.size(), 1U);
  const Bytes envelope = from_spoke_.sent[0];
  Exchange(worker, from_spoke_);
  EXPECT_EQ(from_hub_.heard.size(), 1U);
  EXPECT_EQ(hub_.counters().rejected_direction, 1U);

  EnvelopeView view;
  ASSERT_EQ(OpenEnvelope(envelope, kRoleDeployment, full_.get(), view), EnvelopeFault::kNone);
  ASSERT_EQ(view.header.role, KeyRole::kWorker);
  view.header.nonce += 100;
  EnvelopeBuffer buffer;
  hub_.OnLink(kSpokeAt, SealEnvelope(view.header, Frame(KeyRole::kClient), buffer, full_.get()), now_);
  EXPECT_EQ(from_hub_.heard.size(), 1U);
  EXPECT_EQ(hub_.counters().rejected_direction, 2U);

  hub_.OnBus(bus::Port::kControl, Frame(KeyRole::kClient, true), now_);
  Exchange(client, from_client);
  EXPECT_EQ(from_client.heard, std::vector<Bytes>{Frame(KeyRole::kClient, true)}) << "the route is where it was";
}

TEST_F(LinkRoles, ASpokeBelievesNoHubWithAnotherKey) {
  for (const KeyRole role : {KeyRole::kWorker, KeyRole::kClient}) {
    Sink sink;
    Spoke spoke({kRoleDeployment, full_.get()}, {kHubAt}, 2, sink);
    spoke.Tick(milliseconds(500));
    ASSERT_FALSE(sink.sent.empty());
    EnvelopeView view;
    ASSERT_EQ(OpenEnvelope(sink.sent[0], kRoleDeployment, full_.get(), view), EnvelopeFault::kNone);
    EnvelopeHeader alive = view.header;
    alive.kind = EnvelopeKind::kAlive;
    alive.hub = 5;
    alive.value = view.header.nonce;
    alive.role = role;
    EnvelopeBuffer buffer;
    spoke.OnLink(kHubAt, SealEnvelope(alive, {}, buffer, full_.get()), milliseconds(500));
    EXPECT_FALSE(spoke.linked());
    EXPECT_EQ(spoke.counters().rejected_tag, 1U);
    alive.role = KeyRole::kOperator;
    spoke.OnLink(kHubAt, SealEnvelope(alive, {}, buffer, full_.get()), milliseconds(500));
    EXPECT_TRUE(spoke.linked());
  }
}

}  // namespace
}  // namespace legopt::bridge
