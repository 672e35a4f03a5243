// Hub and spoke in virtual time: which frames are forwarded, which are not, and which peers are trusted. PROTOCOL.md,
// section 14.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "bus/wire.h"
#include "tests/bus/bridge/joined_hosts.h"

namespace legopt::bridge {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class BridgeTest : public testing::Test {
 protected:
  ~BridgeTest() override { EXPECT_EQ(hosts_.first_violation(), ""); }
  const LinkCounters& hub() { return hosts_.server().hub().counters(); }
  void Settle(microseconds time = seconds(1)) {
    hosts_.RunUntil([] { return false; }, time);
  }
  // Returns everything that callers have sent to the hub so far.
  std::vector<Bytes> SentToHub() const {
    std::vector<Bytes> sent;
    for (const auto& letter : const_cast<JoinedHosts&>(hosts_).wire().recorded()) {
      if (letter.to == JoinedHosts::kHubAddress) sent.push_back(letter.bytes);
    }
    return sent;
  }

  JoinedHosts hosts_{2, 1, BridgeTestKey()};
};

TEST_F(BridgeTest, CallsGoThroughOnBothPorts) {
  EXPECT_EQ(hosts_.CallAndWait(0, "small"), "<small>");
  const std::string large(300'000, 'x');
  EXPECT_EQ(hosts_.CallAndWait(1, large), "<" + large + ">");
  EXPECT_EQ(hosts_.handled(), 2);
}

TEST_F(BridgeTest, AnIdleLinkIsOneKnockInTwoSecondsAndTheServersBusHearsNothing) {
  Settle(seconds(3));
  const auto before = hosts_.wire().recorded().size();
  Settle(seconds(100));
  const auto sent = hosts_.wire().recorded().size() - before;
  EXPECT_GE(sent, 2U * 2 * 100 / 3);  // two spokes, each with answers
  EXPECT_LE(sent, 2U * 2 * 100 * 3 / 4);
  EXPECT_EQ(hub().forwarded_up, 0U);
}

TEST_F(BridgeTest, NothingIsBroadcast) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  for (const auto& letter : hosts_.wire().recorded()) {
    EnvelopeView envelope;
    ASSERT_EQ(OpenEnvelope(letter.bytes, 4711, BridgeTestKey().get(), envelope), EnvelopeFault::kNone);
    if (envelope.header.kind != EnvelopeKind::kFrame) continue;
    const bool downwards = letter.from == JoinedHosts::kHubAddress;
    EXPECT_EQ(downwards ? letter.to : letter.from, hosts_.caller(0).address());
  }
}

TEST_F(BridgeTest, AHundredThousandForgedFramesAreNotCarried) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  const auto sent = SentToHub();
  const auto carried = hub().forwarded_up;
  std::mt19937_64 random(7);
  EnvelopeBuffer buffer;
  const auto other_key = BridgeTestKey(1);
  for (int i = 0; i < 100'000; ++i) {
    Bytes forged = sent[random() % sent.size()];
    switch (i % 4) {
      case 0:  // damaged
        forged[random() % forged.size()] ^= static_cast<std::uint8_t>(1 + random() % 255);
        break;
      case 1:  // cut
        forged.resize(random() % forged.size());
        break;
      case 2: {  // sealed with another key, or without one
        EnvelopeView view;
        ASSERT_EQ(OpenEnvelope(sent.back(), 4711, BridgeTestKey().get(), view), EnvelopeFault::kNone);
        view.header.nonce += 1'000'000 + i;
        const auto sealed =
            SealEnvelope(view.header, view.frame, buffer, random() % 2 == 0 ? other_key.get() : nullptr);
        forged.assign(sealed.begin(), sealed.end());
        break;
      }
      default:  // recorded
        break;
    }
    hosts_.server().Take({JoinedHosts::kStranger, JoinedHosts::kHubAddress, forged}, hosts_.now());
  }
  EXPECT_EQ(hub().forwarded_up, carried);
  EXPECT_EQ(hosts_.CallAndWait(0, "b"), "<b>") << "the route is where it was";
}

TEST_F(BridgeTest, LocallyForgedFramesAreNotForwarded) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  const auto before = hosts_.caller(0).spoke().counters();
  bus::FrameHeader header;
  header.kind = bus::FrameKind::kRequest;
  header.type = 1;
  header.deployment = 4711;
  header.sender = JoinedHosts::kFirstCaller + 1;
  header.destination = bus::kServer;
  header.session = header.call_id = header.nonce = 1;
  bus::DatagramBuffer buffer;
  hosts_.caller(0).network().Inject(bus::Port::kControl, bus::SealFrame(header, 0, buffer, BridgeTestKey(1).get()));
  hosts_.caller(0).network().Inject(bus::Port::kControl, bus::SealFrame(header, 0, buffer, nullptr));
  header.destination = JoinedHosts::kFirstCaller + 2;  // callers exchange no frames with each other
  hosts_.caller(0).network().Inject(bus::Port::kControl, bus::SealFrame(header, 0, buffer, BridgeTestKey().get()));
  Settle();
  EXPECT_EQ(hosts_.caller(0).spoke().counters().forwarded_up, before.forwarded_up);
  EXPECT_EQ(hosts_.caller(0).spoke().counters().rejected_tag, before.rejected_tag + 2);
}

TEST_F(BridgeTest, RecordedEnvelopesAreWorthNothingInALaterLifeOfTheHub) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  const auto recorded = SentToHub();
  hosts_.caller(0).EndBridge();  // no spoke proves that its link is alive
  hosts_.caller(1).EndBridge();
  hosts_.StartHub();
  for (const Bytes& bytes : recorded) hosts_.Inject(JoinedHosts::kHubAddress, bytes);
  Settle();
  EXPECT_EQ(hub().forwarded_up, 0U);
  EXPECT_EQ(hosts_.server().hub().num_routes(), 0U);
}

TEST_F(BridgeTest, ARestartedHubIsFoundWithinTwoSeconds) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  hosts_.server().EndBridge();
  Settle(seconds(20));
  hosts_.StartHub();
  EXPECT_EQ(hosts_.CallAndWait(0, "b", seconds(2)), "<b>");
  EXPECT_EQ(hosts_.CallAndWait(1, "c", seconds(2)), "<c>");
}

TEST_F(BridgeTest, AnExchangedHubCostsOneRepeat) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  hosts_.StartHub();
  const auto begin = hosts_.now();
  EXPECT_EQ(hosts_.CallAndWait(0, "b", seconds(2)), "<b>");
  EXPECT_LE(hosts_.now() - begin, milliseconds(500));
}

TEST_F(BridgeTest, AHostThatMovesIsFollowed) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  hosts_.caller(0).MoveTo(5000);  // like a router that forgot our address
  EXPECT_EQ(hosts_.CallAndWait(0, "b", seconds(2)), "<b>");
  hosts_.StartSpoke(0);
  EXPECT_EQ(hosts_.CallAndWait(0, "c", seconds(2)), "<c>");
}

TEST_F(BridgeTest, OfSeveralAddressesOneThatAnswersIsTaken) {
  hosts_.caller(0).BecomeSpoke({3001, 3002, JoinedHosts::kHubAddress}, 5);
  EXPECT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  EXPECT_EQ(hosts_.caller(0).spoke().connected(), JoinedHosts::kHubAddress);
}

TEST_F(BridgeTest, ALostHubIsLookedForAtAllAddresses) {
  hosts_.caller(0).BecomeSpoke({JoinedHosts::kHubAddress, 3001}, 5);
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  hosts_.server().EndBridge();
  Settle(seconds(10));
  EXPECT_EQ(hosts_.caller(0).spoke().connected(), std::nullopt);
  const auto& recorded = hosts_.wire().recorded();
  EXPECT_EQ(recorded.back().from == hosts_.caller(0).address() || recorded.back().from == hosts_.caller(1).address(),
            true);
  EXPECT_TRUE(std::any_of(recorded.end() - 8, recorded.end(), [](const auto& letter) { return letter.to == 3001; }));
}

TEST_F(BridgeTest, AnotherKeyIsNotAnswered) {
  JoinedHosts others(1, 2, BridgeTestKey(1));
  const auto before = hub().rejected_tag;
  others.RunUntil([] { return false; }, seconds(1));
  for (const auto& letter : others.wire().recorded()) {
    if (letter.to == JoinedHosts::kHubAddress) hosts_.Inject(JoinedHosts::kHubAddress, letter.bytes);
  }
  Settle();
  EXPECT_GT(hub().rejected_tag, before);
  for (const auto& letter : hosts_.wire().recorded()) EXPECT_NE(letter.to, JoinedHosts::kStranger);
}

TEST_F(BridgeTest, ARouteIsForgottenAfterItsLife) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  EXPECT_EQ(hosts_.server().hub().num_routes(), 1U);
  Settle(HubOptions().route_life + seconds(1));
  EXPECT_EQ(hosts_.server().hub().num_routes(), 0U);
  EXPECT_EQ(hosts_.CallAndWait(0, "b"), "<b>");
}

TEST_F(BridgeTest, BeyondTheBoundTheLongestSilentIsForgotten) {
  HubOptions options;
  options.max_routes = 1;
  hosts_.server().BecomeHub(77, options);
  EXPECT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  EXPECT_EQ(hosts_.CallAndWait(1, "b"), "<b>");
  EXPECT_EQ(hosts_.server().hub().num_routes(), 1U);
  EXPECT_EQ(hosts_.CallAndWait(0, "c"), "<c>");
}

TEST_F(BridgeTest, FrameOfAnotherVersionReachesTheServer) {
  ASSERT_EQ(hosts_.CallAndWait(0, "a"), "<a>");
  bus::FrameHeader header;
  header.version = bus::kProtocolVersion + 1;
  header.kind = bus::FrameKind::kRequest;
  header.type = 1;
  header.deployment = 4711;
  header.sender = JoinedHosts::kFirstCaller + 1;
  header.destination = bus::kServer;
  header.session = header.call_id = header.nonce = 1;
  bus::DatagramBuffer buffer;
  LinkCounters counters;
  const auto key = BridgeTestKey();
  EXPECT_TRUE(CheckFrameTag(bus::SealFrame(header, 0, buffer, key.get()), {4711, key.get()}, counters));
  EXPECT_FALSE(CheckFrameTag(bus::SealFrame(header, 0, buffer, nullptr), {4711, key.get()}, counters));
  EXPECT_FALSE(CheckFrameTag(bus::SealFrame(header, 0, buffer, key.get()), {4712, key.get()}, counters));
  EXPECT_EQ(counters.rejected_tag, 1U);
  EXPECT_EQ(counters.rejected_deployment, 1U);
}

}  // namespace
}  // namespace legopt::bridge
