// Reach policy: with TTL 0 a deployment neither sends to other hosts nor receives from them, for any routes and
// interfaces; with a higher TTL it follows the route. Two network namespaces joined by a veth cable act as two hosts.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/if_ether.h>
#include <linux/seccomp.h>
#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "bus/bus_error.h"
#include "bus/wire.h"
#include "tests/bus/lcm_parties.h"
#include "tests/bus/test_bed.h"

namespace legopt::bus {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// Interface names: "near" on this host, "far" on the other.
constexpr char kNearAddress[] = "10.97.0.1";

bool Shell(const std::string& command) { return std::system((command + " 2>/dev/null").c_str()) == 0; }

int OwnNamespace() { return ::open("/proc/thread-self/ns/net", O_RDONLY | O_CLOEXEC); }

// Two hosts. The constructing thread runs on the near host, except in AtFar.
class TwoHosts {
 public:
  TwoHosts() {
    if (::unshare(CLONE_NEWNET) != 0) {
      refused_ = std::string("unshare(CLONE_NEWNET): ") + std::strerror(errno);
      return;
    }
    near_ = OwnNamespace();
    if (::unshare(CLONE_NEWNET) != 0 || (far_ = OwnNamespace()) < 0 || ::setns(near_, CLONE_NEWNET) != 0) {
      refused_ = std::string("a second network namespace: ") + std::strerror(errno);
    } else if (!Shell("ip link set lo up") || !ConnectCable()) {
      refused_ = "ip link add ... type veth";
    }
  }
  ~TwoHosts() {
    if (near_ >= 0) ::close(near_);
    if (far_ >= 0) ::close(far_);
  }
  TwoHosts(const TwoHosts&) = delete;
  TwoHosts& operator=(const TwoHosts&) = delete;

  const std::string& refused() const { return refused_; }

  bool ConnectCable() {
    const std::string place = "/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(far_);
    bool far_up = false;
    const bool near_up = Shell("ip link add near type veth peer name far netns " + place) &&
                         Shell(std::string("ip addr add ") + kNearAddress + "/24 dev near") &&
                         Shell("ip link set near up");
    AtFar([&] {
      far_up = Shell("ip link set lo up") && Shell("ip addr add 10.97.0.2/24 dev far") && Shell("ip link set far up");
    });
    return near_up && far_up;
  }

  void AtFar(const std::function<void()>& action) const {
    ::setns(far_, CLONE_NEWNET);
    action();
    ::setns(near_, CLONE_NEWNET);
  }

 private:
  int near_ = -1, far_ = -1;
  std::string refused_;
};

// Runs `body` with two hosts; skips the test if they cannot be created.
void WithTwoHosts(const std::function<void(TwoHosts&)>& body) {
  std::string refused;
  OnThread([&] {
    TwoHosts hosts;
    refused = hosts.refused();
    if (refused.empty()) body(hosts);
  });
  if (!refused.empty()) GTEST_SKIP() << "NOT TESTED, two network namespaces joined by veth need root: " << refused;
}

sockaddr_in Address(const char* host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  ::inet_pton(AF_INET, host, &address.sin_addr);
  return address;
}

void SendPacket(int fd, const std::string& packet, const char* host, int port) {
  const sockaddr_in to = Address(host, port);
  EXPECT_EQ(::sendto(fd, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to),
            static_cast<ssize_t>(packet.size()));
}

int UdpSocket(unsigned char ttl) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  ::setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  return fd;
}

// Returns an LCM packet with a legal frame of any kind and type from a stranger to the server.
std::string PacketOf(FrameKind kind, std::int16_t type, std::int64_t deployment) {
  FrameHeader header;
  header.kind = kind;
  header.type = type;
  header.deployment = deployment;
  header.sender = kClient;
  header.destination = kServer;
  header.session = 1;
  header.call_id = type;
  header.nonce = 1;
  DatagramBuffer buffer{};
  const auto frame = SealFrame(header, 0, buffer);
  return std::string("LC02\0\0\0\0LEGOPT\0", 15) + std::string(frame.begin(), frame.end());
}

std::size_t SendEverythingFromFar(const TwoHosts& hosts, const LcmOptions& options, std::int64_t deployment) {
  std::size_t sent = 0;
  hosts.AtFar([&] {
    Shell("ip route add default dev far");
    const int fd = UdpSocket(1);
    for (int type = 1; type <= kLastMessageType; ++type) {
      for (int kind = 1; kind <= kLastFrameKind; ++kind) {
        const std::string packet = PacketOf(static_cast<FrameKind>(kind), static_cast<std::int16_t>(type), deployment);
        for (const char* host : {kGroup, kNearAddress}) {
          for (const int port : {options.port, options.port + 1}) SendPacket(fd, packet, host, port);
          sent += 2;
        }
      }
    }
    ::close(fd);
  });
  return sent;
}

// Listens to the group on every interface of this host, without a filter.
class Witness {
 public:
  explicit Witness(int port) : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    const int on = 1;
    const sockaddr_in address = Address("0.0.0.0", port);
    ::setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ip_mreq membership{};
    ::inet_pton(AF_INET, kGroup, &membership.imr_multiaddr);
    ::inet_pton(AF_INET, kNearAddress, &membership.imr_interface);
    EXPECT_EQ(::setsockopt(fd_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership), 0);
  }
  ~Witness() { ::close(fd_); }
  Witness(const Witness&) = delete;
  Witness& operator=(const Witness&) = delete;

  std::size_t Count() const {
    std::array<char, kMaxDatagramBytes + 100> packet{};
    std::size_t count = 0;
    while (::recv(fd_, packet.data(), packet.size(), 0) >= 0) ++count;
    return count;
  }

 private:
  int fd_;
};

// Counts the UDP multicasts that arrive at the far host.
class FarPacketCounter {
 public:
  explicit FarPacketCounter(const TwoHosts& hosts) {
    hosts.AtFar([this] { fd_ = ::socket(AF_PACKET, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, htons(ETH_P_IP)); });
  }
  ~FarPacketCounter() { ::close(fd_); }
  FarPacketCounter(const FarPacketCounter&) = delete;
  FarPacketCounter& operator=(const FarPacketCounter&) = delete;

  // Returns the number since the last call; waits for the first one, at most `patience`.
  std::size_t Count(milliseconds patience) const {
    const auto end = std::chrono::steady_clock::now() + patience;
    std::size_t count = 0;
    while (TakeError()) {
    }
    do {
      pollfd arrival{fd_, POLLIN, 0};
      constexpr int kSlice_ms = 10;
      ::poll(&arrival, 1, kSlice_ms);
      count += Drain();
    } while (count == 0 && std::chrono::steady_clock::now() < end);
    return count;
  }

 private:
  // IGMP packets are not counted.
  std::size_t Drain() const {
    constexpr std::size_t kProtocol = 23, kDestination = 30;
    constexpr unsigned char kGroupNet = 239;
    std::array<unsigned char, 2000> packet{};
    std::size_t count = 0;
    for (ssize_t size = 0; (size = ::recv(fd_, packet.data(), packet.size(), 0)) >= 0;) {
      if (packet[kProtocol] == IPPROTO_UDP && packet[kDestination] == kGroupNet) ++count;
    }
    return count;
  }
  // An interface that goes down leaves an error in the queue ahead of waiting packets.
  bool TakeError() const {
    int error = 0;
    socklen_t size = sizeof error;
    return ::getsockopt(fd_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 && error != 0;
  }

  int fd_ = -1;
};

void PollFor(Host& host, milliseconds duration) {
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) host.endpoint.Poll(milliseconds(10));
}

TEST(Reach, WithTtlZeroNothingOfAnotherHostIsHeard) {
  WithTwoHosts([](TwoHosts& hosts) {
    // The group's route leads to the cable, to loopback, or does not exist.
    for (const char* route : {"239.255.76.67/32 dev near", "239.255.76.67/32 dev lo", ""}) {
      SCOPED_TRACE(route);
      EXPECT_TRUE(*route == '\0' || Shell(std::string("ip route add ") + route));
      const LcmOptions options = FreshOptions();
      Host server(options, kServer);
      const Witness witness(options.port);
      const std::size_t sent = SendEverythingFromFar(hosts, options, server.transport.deployment());
      PollFor(server, milliseconds(200));
      EXPECT_GE(witness.Count(), sent / 4) << "the packets have come as far as this host";
      EXPECT_EQ(server.endpoint.counters().datagrams_received, 0U);
      Host client(options, kClient);
      ServeEcho(server);
      EXPECT_TRUE(EchoBetween(client, server)) << "programs of this host are heard";
      EXPECT_TRUE(*route == '\0' || Shell(std::string("ip route del ") + route));
    }
  });
}

TEST(Reach, WithTtlZeroNothingLeavesTheHostWhenRoutesAndLinksChange) {
  WithTwoHosts([](TwoHosts& hosts) {
    const LcmOptions options = FreshOptions();
    const FarPacketCounter far(hosts);
    // TTL 0 alone is not sufficient: a socket that follows the route reaches the other host.
    ASSERT_TRUE(Shell("ip route add 239.255.76.67/32 dev near"));
    const int fd = UdpSocket(0);
    SendPacket(fd, "x", kGroup, options.port);
    ::close(fd);
    EXPECT_EQ(far.Count(seconds(10)), 1U);
    ASSERT_TRUE(Shell("ip route del 239.255.76.67/32 dev near && ip route add 239.255.76.67/32 dev lo"));
    Host server(options, kServer);
    Host early(options, kClient);
    ServeEcho(server);
    EXPECT_TRUE(EchoBetween(early, server));
    ASSERT_TRUE(Shell("ip route del 239.255.76.67/32 dev lo && ip route add 239.255.76.67/32 dev near"));
    EXPECT_TRUE(EchoBetween(early, server)) << "after the route has moved";
    Host late(options, kClient + 1);
    EXPECT_TRUE(EchoBetween(late, server)) << "between before and after the move";
    ASSERT_TRUE(Shell("ip link set near down && ip link set near up"));
    EXPECT_TRUE(EchoBetween(early, server)) << "after the link was down";
    ASSERT_TRUE(Shell("ip link set lo down && ip link set lo up"));
    EXPECT_TRUE(EchoBetween(late, server)) << "after loopback was down";
    Shell("ip route del 239.255.76.67/32");
    EXPECT_TRUE(EchoBetween(late, server)) << "without a route";
    EXPECT_EQ(far.Count(milliseconds(200)), 0U);
    EXPECT_FALSE(Shell("sed -n '/near/,$p' /proc/net/igmp | grep 434CFFEF"))
        << "this host is a member on loopback only";
  });
}

TEST(Reach, WithTtlZeroNoRouteIsNeeded) {
  WithTwoHosts([](TwoHosts& /*hosts*/) {
    const LcmOptions options = FreshOptions();
    EXPECT_TRUE(EchoWorks(options));
    EXPECT_TRUE(ProbeMulticastRoute(kGroup).usable);
    EXPECT_FALSE(ProbeMulticastRoute(kGroup, 1).usable);
    // A packet made without LCM, and one sent by LCM.
    Host server(options, kServer);
    ServeEcho(server);
    ASSERT_TRUE(Shell("ip route add 239.255.76.67/32 dev near"));
    Host client(options, kClient);
    EXPECT_TRUE(EchoBetween(client, server));
  });
}

TEST(Reach, AboveTtlZeroTheGroupIsJoinedAnewWhereTheRouteLeads) {
  WithTwoHosts([](TwoHosts& hosts) {
    LcmOptions options = FreshOptions();
    options.ttl = 1;
    options.key = TestKey();
    options.trust_network = true;
    const auto route = [&hosts] {
      hosts.AtFar([] { EXPECT_TRUE(Shell("ip route add 239.255.76.67/32 dev far")); });
      return Shell("ip route add 239.255.76.67/32 dev near");
    };
    ASSERT_TRUE(route());
    Host server(options, kServer);
    ServeEcho(server);
    std::optional<Host> client;
    hosts.AtFar([&] { client.emplace(options, kClient); });
    EXPECT_TRUE(EchoBetween(*client, server));
    // The cable is replaced, which gives both hosts new interfaces.
    ASSERT_TRUE(Shell("ip link del near"));
    PollFor(server, milliseconds(50));
    ASSERT_TRUE(hosts.ConnectCable() && route());
    EXPECT_TRUE(EchoBetween(*client, server));
  });
}

// Makes the kernel refuse SO_ATTACH_FILTER to the calling thread permanently.
bool RefuseSocketFilters() {
  constexpr std::uint32_t kOption = offsetof(seccomp_data, args) + 2 * sizeof(std::uint64_t);
  std::array<sock_filter, 6> code = {
      {BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_setsockopt, 0, 3), BPF_STMT(BPF_LD | BPF_W | BPF_ABS, kOption),
       BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SO_ATTACH_FILTER, 0, 1),
       BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM), BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW)}};
  const sock_fprog program{static_cast<unsigned short>(code.size()), code.data()};
  return ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) == 0;
}

TEST(Reach, WithoutSocketFilterAKeyIsNeeded) {
  bool refused = false, keyed = false;
  std::string message;
  OnThread([&] {
    if (!RefuseSocketFilters()) return;
    refused = true;
    LcmOptions options = FreshOptions();
    try {
      const LcmTransport transport(options);
    } catch (const BusError& error) {
      message = error.what();
    }
    options.key = TestKey();
    try {
      keyed = EchoWorks(options);
    } catch (const BusError& error) {
      ADD_FAILURE() << error.what();
    }
  });
  if (!refused) GTEST_SKIP() << "NOT TESTED: seccomp is refused here";
  EXPECT_NE(message.find("legopt service keygen"), std::string::npos) << message;
  EXPECT_TRUE(keyed);
}

}  // namespace
}  // namespace legopt::bus
