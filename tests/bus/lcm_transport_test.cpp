// Behaviour specific to the real transport: start-up errors with their codes, the socket filter, and kernel limits.
#include "bus/lcm_transport.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "tests/bus/lcm_parties.h"
#include "tests/bus/test_bed.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::optional<BusErrorCode> CodeOf(const LcmOptions& options, std::string* message = nullptr) {
  try {
    LcmTransport transport(options);
  } catch (const BusError& error) {
    if (message != nullptr) *message = error.what();
    return error.code();
  }
  return std::nullopt;
}

class Udp : public testing::Test {
 protected:
  void SetUp() override {
    const MulticastRoute route = ProbeMulticastRoute(kGroup);
    if (route.usable) return;
    const std::string refused = EnterPrivateNetwork(true);
    if (!refused.empty()) GTEST_SKIP() << "NOT TESTED: " << route.problem << "; refused: " << refused;
  }
};

TEST(LcmStartUp, WithoutMulticastRouteTheErrorNamesTheFix) {
  std::string refused;
  std::string message;
  std::optional<BusErrorCode> code;
  MulticastRoute route;
  OnThread([&] {
    refused = EnterPrivateNetwork(false);
    if (!refused.empty()) return;
    LcmOptions options;
    options.port = 23456;
    code = CodeOf(options, &message);
    route = ProbeMulticastRoute(kGroup);
  });
  if (!refused.empty()) GTEST_SKIP() << "NOT TESTED, no network namespace without routes: " << refused;
  EXPECT_EQ(code, BusErrorCode::kNoMulticastRoute) << message;
  EXPECT_NE(message.find("ip link set lo up && ip route add 239.255.76.67/32 dev lo"), std::string::npos) << message;
  EXPECT_FALSE(route.usable);
  EXPECT_EQ(route.problem, message);
}

TEST(LcmStartUp, TheFixThatTheErrorNamesIsEnough) {
  std::string refused;
  bool works = false;
  OnThread([&] {
    refused = EnterPrivateNetwork(true);
    if (refused.empty()) works = EchoWorks(FreshOptions());
  });
  if (!refused.empty()) GTEST_SKIP() << "NOT TESTED, no network namespace: " << refused;
  EXPECT_TRUE(works);
}

TEST_F(Udp, APortHeldByAnotherProgramIsUnusable) {
  for (const int offset : {0, 1}) {
    const LcmOptions options = FreshOptions();
    const int holder = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(options.port + offset));
    ASSERT_EQ(::bind(holder, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    std::string message;
    EXPECT_EQ(CodeOf(options, &message), BusErrorCode::kPortUnusable);
    EXPECT_NE(message.find(std::to_string(options.port + offset)), std::string::npos) << message;
    ::close(holder);
    EXPECT_EQ(CodeOf(options), std::nullopt);
  }
}

// A descriptor number that another thread closes while LCM opens its sockets must not hide one of LCM's sockets.
TEST_F(Udp, OtherThreadsMayOpenAndCloseFilesMeanwhile) {
  std::atomic<bool> stop{false};
  std::vector<std::thread> busy;
  for (const int type : {SOCK_DGRAM, SOCK_STREAM}) {
    busy.emplace_back([&stop, type] {
      while (!stop) {
        std::array<int, 2> pair{-1, -1};
        if (::socketpair(AF_UNIX, type, 0, pair.data()) != 0) continue;
        std::this_thread::sleep_for(std::chrono::microseconds(50));
        for (const int fd : pair) ::close(fd);
      }
    });
  }
  const LcmOptions options = FreshOptions();
  constexpr int kTransports = 50;
  std::string message;
  int failures = 0;
  for (int i = 0; i < kTransports; ++i) failures += CodeOf(options, &message) ? 1 : 0;
  stop = true;
  for (std::thread& thread : busy) thread.join();
  EXPECT_EQ(failures, 0) << message;
}

TEST(LcmOptionsTest, BadValuesAreNamed) {
  const auto fault = [](auto change) {
    LcmOptions options;
    change(options);
    std::string message;
    EXPECT_EQ(CodeOf(options, &message), BusErrorCode::kInvalidOption);
    return message;
  };
  EXPECT_NE(fault([](LcmOptions& o) { o.group = "10.0.0.1"; }).find("group: \"10.0.0.1\""), std::string::npos);
  EXPECT_NE(fault([](LcmOptions& o) { o.group = "nonsense"; }).find("group"), std::string::npos);
  EXPECT_NE(fault([](LcmOptions& o) { o.port = 65535; }).find("port: 65535"), std::string::npos);
  EXPECT_NE(fault([](LcmOptions& o) { o.port = 80; }).find("port"), std::string::npos);
  EXPECT_NE(fault([](LcmOptions& o) { o.ttl = 256; }).find("ttl"), std::string::npos);
  EXPECT_NE(fault([](LcmOptions& o) { o.deployment = -1; }).find("deployment"), std::string::npos);
}

TEST(LcmOptionsTest, EnvironmentOverridesDefaults) {
  ::setenv("LEGOPT_PORT", "8123", 1);
  ::setenv("LEGOPT_GROUP", "239.1.2.3", 1);
  EXPECT_EQ(LcmOptions::FromEnvironment().port, 8123);
  EXPECT_EQ(LcmOptions::FromEnvironment().group, "239.1.2.3");
  for (const char* illegal : {"many", " 8123", "8123 ", "+8123", "0x1fbb"}) {
    ::setenv("LEGOPT_PORT", illegal, 1);
    EXPECT_THROW(LcmOptions::FromEnvironment(), BusError) << illegal;
  }
  ::unsetenv("LEGOPT_PORT");
  ::unsetenv("LEGOPT_GROUP");
  ::setenv("LEGOPT_DEPLOYMENT", "77", 1);
  EXPECT_EQ(LcmOptions::FromEnvironment().deployment, 77);
  for (const char* illegal : {"0", "-1", "many", " 77", "99999999999999999999"}) {
    ::setenv("LEGOPT_DEPLOYMENT", illegal, 1);
    EXPECT_THROW(LcmOptions::FromEnvironment(), BusError) << illegal;
  }
  ::unsetenv("LEGOPT_DEPLOYMENT");
}

TEST_F(Udp, EqualAddressesMeanOneDeployment) {
  const LcmOptions options = FreshOptions();
  LcmOptions other = options;
  other.port = FindFreePortPair(RandomSeed());
  const LcmTransport first(options);
  const LcmTransport second(options);
  const LcmTransport third(other);
  EXPECT_GT(first.deployment(), 0);
  EXPECT_EQ(first.deployment(), second.deployment());
  EXPECT_NE(first.deployment(), third.deployment());
}

TEST_F(Udp, TheReceiveBufferIsReadBack) {
  LcmOptions options = FreshOptions();
  options.receive_buffer_bytes = 100'000;
  const LcmTransport modest(options);
  EXPECT_GE(modest.granted_receive_buffer_bytes(), 2 * options.receive_buffer_bytes);
  EXPECT_EQ(modest.receive_buffer_warning(), "");
}

TEST_F(Udp, ADatagramAboveTheLimitIsABrokenInvariant) {
  LcmTransport transport(FreshOptions());
  const std::vector<std::uint8_t> large(kMaxDatagramBytes + 1);
  EXPECT_DEATH(transport.Send(Port::kControl, large), "1201 bytes");
}

TEST_F(Udp, TheSocketFilterKeepsTheTrafficOfOthersAway) {
  const LcmOptions options = FreshOptions();
  Host server(options, kServer);
  Host client(options, kClient);
  Host bystander(options, kClient + 1);
  if (!bystander.transport.socket_filter_attached()) GTEST_SKIP() << "NOT TESTED: no socket filters here";
  server.endpoint.Serve(MessageType::kProbe,
                        [](Request&& request, Responder responder) { responder.Reply(request.body); });
  int answers = 0;
  constexpr int kCalls = 50;
  const std::vector<Endpoint*> all = {&server.endpoint, &client.endpoint, &bystander.endpoint};
  for (int i = 0; i < kCalls; ++i) {
    client.endpoint.Call(kServer, MessageType::kProbe, "ping", {}, [&](CallResult&&) { ++answers; });
    ASSERT_TRUE(RunUntil(all, [&] { return answers == i + 1; }));
  }
  EXPECT_EQ(bystander.endpoint.counters().datagrams_received, 0U);
  EXPECT_GE(bystander.endpoint.counters().kernel_filtered, 2U * kCalls);
}

// Long-form packets, other channels and garbage on the live ports (acceptance figure 14).
TEST_F(Udp, PacketsThatLcmMustNotSeeAreKeptAway) {
  const LcmOptions options = FreshOptions();
  Host server(options, kServer);
  if (!server.transport.socket_filter_attached()) GTEST_SKIP() << "NOT TESTED: no socket filters here";
  const int fd = ::socket(AF_INET, SOCK_DGRAM, 0);
  const unsigned char ttl = 0;
  ip_mreqn loopback{};
  loopback.imr_ifindex = static_cast<int>(::if_nametoindex("lo"));
  ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof(ttl));
  ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof(loopback));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(options.port));
  ::inet_pton(AF_INET, kGroup, &address.sin_addr);
  const auto send = [&](const std::string& packet) {
    ::sendto(fd, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  };
  // A fragment whose offset wraps around crashes an unprotected receiver.
  const std::string wrapping("LC03\0\0\0\1\0\0\0\x10\xFF\xFF\xFF\xF8\0\1\0\2AAAAAAAAAAAAAAAAAAAAAAAA", 44);
  send(wrapping);
  for (int i = 0; i < 100; ++i)
    send(std::string("LC02\0\0\0\0", 8) + "channel" + std::to_string(i) + std::string(50, '\0'));
  send("x");
  constexpr std::uint64_t kPackets = 102;
  EXPECT_TRUE(RunUntil({&server.endpoint}, [&] { return server.endpoint.counters().kernel_filtered >= kPackets; }));
  EXPECT_EQ(server.endpoint.counters().datagrams_received, 0U);
  ::close(fd);
  EXPECT_TRUE(EchoWorks(options));
}

TEST_F(Udp, ExtraDescriptorsWakeThePoll) {
  Host host(FreshOptions(), kServer);
  int pipe_fds[2];
  ASSERT_EQ(::pipe(pipe_fds), 0);
  ASSERT_EQ(::write(pipe_fds[1], "x", 1), 1);
  pollfd extra{pipe_fds[0], POLLIN, 0};
  host.endpoint.PollWith({&extra, 1}, seconds(30));
  EXPECT_EQ(extra.revents, POLLIN);
  char byte = 0;
  ASSERT_EQ(::read(pipe_fds[0], &byte, 1), 1);
  host.endpoint.PollWith({&extra, 1}, milliseconds(0));
  EXPECT_EQ(extra.revents, 0);
  ::close(pipe_fds[0]);
  ::close(pipe_fds[1]);
}

TEST_F(Udp, NoDescriptorIsInheritedByPrograms) {
  const LcmTransport transport(FreshOptions());
  // The shell lists its inherited descriptors; sockets would appear as socket:[...].
  EXPECT_NE(std::system("ls -l /proc/self/fd | grep -q socket:"), 0);
}

TEST_F(Udp, ManyTransportsComeAndGo) {
  const auto descriptors = [] { return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {}); };
  const LcmOptions options = FreshOptions();
  { const LcmTransport warm_up(options); }
  const auto before = descriptors();
  constexpr int kTimes = 5;
  for (int i = 0; i < kTimes; ++i) const LcmTransport transport(options);
  EXPECT_EQ(descriptors(), before);
}

}  // namespace
}  // namespace legopt::bus
