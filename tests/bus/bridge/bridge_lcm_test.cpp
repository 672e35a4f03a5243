// The thread between LCM and a link, over real sockets of this host: calls between two buses connected only by it.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bus/bridge/bridge.h"
#include "bus/bridge/link.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "tests/bus/bridge/joined_hosts.h"

namespace legopt::bridge {
namespace {

using std::chrono::seconds;

constexpr std::int64_t kDeploymentOfBoth = 4711;
constexpr LinkAddress kAnyPortMask = ~LinkAddress{0xFFFF};

LinkAddress Loopback() { return ParseLinkAddress("127.0.0.1:1") & kAnyPortMask; }

class BridgeLcmTest : public testing::Test {
 protected:
  void SetUp() override {
    const bus::MulticastRoute route = bus::ProbeMulticastRoute(bus::LcmOptions().group);
    if (!route.usable) GTEST_SKIP() << "NO MULTICAST HERE: " << route.problem;
    near_ = BusOfOne();
    far_ = BusOfOne();
    server_transport_ = std::make_unique<bus::LcmTransport>(near_);
    server_ = std::make_unique<bus::Endpoint>(*server_transport_, bus::kServer, bus::RandomSeed());
    server_->Serve(bus::MessageType::kQuery,
                   [](bus::Request&& request, bus::Responder responder) { responder.Reply("<" + request.body + ">"); });
    LinkSocket socket{Loopback()};
    hub_address_ = socket.address();
    hub_ = Bridge::RunHub(near_, std::move(socket));
    spoke_ = Bridge::RunSpoke(far_, LinkSocket(Loopback()), {hub_address_});
    client_transport_ = std::make_unique<bus::LcmTransport>(far_);
    client_ = std::make_unique<bus::Endpoint>(*client_transport_, JoinedHosts::kFirstCaller, bus::RandomSeed());
  }

  static bus::LcmOptions BusOfOne() {
    bus::LcmOptions options;
    options.port = bus::FindFreePortPair(bus::RandomSeed());
    options.deployment = kDeploymentOfBoth;
    options.key = BridgeTestKey();
    return options;
  }

  std::string Call(const std::string& body) {
    std::optional<bus::CallResult> result;
    client_->Call(bus::kServer, bus::MessageType::kQuery, body, {},
                  [&](bus::CallResult&& r) { result = std::move(r); });
    while (!result) {
      server_->Poll(std::chrono::milliseconds(1));
      client_->Poll(std::chrono::milliseconds(1));
    }
    return result->status == bus::CallResult::kOk ? result->body : "";
  }

  bus::LcmOptions near_, far_;
  std::unique_ptr<bus::LcmTransport> server_transport_, client_transport_;
  std::unique_ptr<bus::Endpoint> server_, client_;
  LinkAddress hub_address_ = 0;
  std::unique_ptr<Bridge> hub_, spoke_;
};

TEST_F(BridgeLcmTest, CallsGoThroughAndSurviveAnExchangeOfTheHub) {
  EXPECT_EQ(Call("small"), "<small>");
  const std::string large(100'000, 'x');
  EXPECT_EQ(Call(large), "<" + large + ">");
  hub_.reset();
  hub_ = Bridge::RunHub(near_, LinkSocket(hub_address_));
  EXPECT_EQ(Call("again"), "<again>");
}

TEST_F(BridgeLcmTest, OfAHundredThousandForgedDatagramsNoneIsCarried) {
  ASSERT_EQ(Call("a"), "<a>");
  const auto before = hub_->counters();
  const LinkSocket stranger{Loopback()};
  std::mt19937_64 random(3);
  EnvelopeBuffer buffer;
  const std::vector<std::uint8_t> frame(200, 7);
  constexpr int kForged = 100'000;
  const auto other_key = BridgeTestKey(1);
  for (int i = 1; i <= kForged; ++i) {
    EnvelopeHeader header;
    header.kind = EnvelopeKind::kFrame;
    header.deployment = kDeploymentOfBoth;
    header.link = header.nonce = i;
    stranger.Send(hub_address_, SealEnvelope(header, frame, buffer, random() % 2 == 0 ? other_key.get() : nullptr));
    if (i % 100 == 0) std::this_thread::yield();
  }
  EXPECT_EQ(Call("b"), "<b>");
  const auto after = hub_->counters();
  EXPECT_GT(after.rejected_tag - before.rejected_tag, kForged / 100U) << "they arrived";
  EXPECT_LE(after.forwarded_up - before.forwarded_up, 10U) << "the call and its repeats";
  std::vector<std::uint8_t> room(kMaxEnvelopeBytes);
  LinkAddress from = 0;
  EXPECT_EQ(stranger.Receive(room, from), 0U) << "nobody without the key is answered";
}

TEST(LinkAddressTest, TextsOfAddresses) {
  EXPECT_EQ(ToString(ParseLinkAddress("10.1.2.3:7669")), "10.1.2.3:7669");
  EXPECT_EQ(ToString(ParseLinkAddress("7669")), "0.0.0.0:7669");
  EXPECT_TRUE(IsLoopback(ParseLinkAddress("127.3.2.1:9")));
  EXPECT_FALSE(IsLoopback(ParseLinkAddress("7669")));
  for (const char* bad : {"", ":", "10.1.2.3", "10.1.2.3:", "10.1.2.3:0", "10.1.2.3:65536", "host:7669", "::1", "-1"}) {
    EXPECT_THROW(ParseLinkAddress(bad), bus::BusError) << bad;
  }
  EXPECT_EQ(ReachableAddresses(ParseLinkAddress("10.1.2.3:7669")).size(), 1U);
}

TEST(LinkSocketTest, ATakenPortIsNamed) {
  const LinkSocket first{Loopback()};
  try {
    const LinkSocket second(first.address());
    ADD_FAILURE() << "taken twice";
  } catch (const bus::BusError& error) {
    EXPECT_EQ(error.code(), bus::BusErrorCode::kPortUnusable);
    EXPECT_NE(std::string(error.what()).find(ToString(first.address())), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace legopt::bridge
