#include "bus/multicast.h"

#include <arpa/inet.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <random>
#include <string_view>
#include <system_error>

#include "bus/endpoint.h"
#include "bus/lcm_transport.h"
#include "legopt/files/written_file.h"

namespace legopt::bus {
namespace {

// Request to rtnetlink for the route of one IPv4 address.
struct RouteRequest {
  nlmsghdr header{};
  rtmsg route{};
  rtattr attribute{};
  in_addr destination{};
};

int OutputInterface(const nlmsghdr* answer, int bytes) {
  if (!NLMSG_OK(answer, static_cast<unsigned>(bytes)) || answer->nlmsg_type != RTM_NEWROUTE) return 0;
  const auto* route = reinterpret_cast<const rtmsg*>(answer + 1);
  auto left = static_cast<int>(RTM_PAYLOAD(answer));
  for (const rtattr* each = RTM_RTA(route); RTA_OK(each, left); each = RTA_NEXT(each, left)) {
    if (each->rta_type != RTA_OIF) continue;
    int interface = 0;
    std::memcpy(&interface, RTA_DATA(each), sizeof interface);
    return interface;
  }
  return 0;
}

ip_mreqn Membership(const in_addr& group, int interface) {
  ip_mreqn membership{};
  membership.imr_multiaddr = group;
  membership.imr_ifindex = interface;
  return membership;
}

}  // namespace

int LoopbackIndex() { return static_cast<int>(::if_nametoindex("lo")); }

int RouteOf(const in_addr& group) {
  constexpr unsigned char kWholeAddress = 32;
  const int fd = ::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_ROUTE);
  if (fd < 0) return 0;
  RouteRequest request;
  request.header.nlmsg_len = sizeof request;
  request.header.nlmsg_type = RTM_GETROUTE;
  request.header.nlmsg_flags = NLM_F_REQUEST;
  request.route.rtm_family = AF_INET;
  request.route.rtm_dst_len = kWholeAddress;
  request.attribute.rta_type = RTA_DST;
  request.attribute.rta_len = RTA_LENGTH(sizeof request.destination);
  request.destination = group;
  alignas(nlmsghdr) std::array<char, 4096> answer{};
  ssize_t bytes = ::send(fd, &request, sizeof request, 0);
  if (bytes > 0) bytes = ::recv(fd, answer.data(), answer.size(), 0);
  ::close(fd);
  return bytes <= 0 ? 0 : OutputInterface(reinterpret_cast<const nlmsghdr*>(answer.data()), static_cast<int>(bytes));
}

bool HasRoute(const in_addr& group) {
  constexpr std::uint16_t kAnyPort = 9;  // nothing is sent
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kAnyPort);
  address.sin_addr = group;
  const bool connected = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  if (fd >= 0) ::close(fd);
  return connected;
}

std::string InterfaceName(int interface) {
  std::array<char, IF_NAMESIZE> name{};
  return ::if_indextoname(static_cast<unsigned>(interface), name.data()) == nullptr ? "" : name.data();
}

bool SendThrough(int socket_fd, int interface) {
  const ip_mreqn target = Membership({}, interface);
  return ::setsockopt(socket_fd, IPPROTO_IP, IP_MULTICAST_IF, &target, sizeof target) == 0;
}

bool JoinGroup(int socket_fd, const in_addr& group, int interface) {
  const ip_mreqn membership = Membership(group, interface);
  return ::setsockopt(socket_fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) == 0 ||
         errno == EADDRINUSE;
}

void LeaveGroup(int socket_fd, const in_addr& group, int interface) {
  const ip_mreqn membership = Membership(group, interface);
  ::setsockopt(socket_fd, IPPROTO_IP, IP_DROP_MEMBERSHIP, &membership, sizeof membership);
}

InterfaceWatch::InterfaceWatch() : fd_(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE)) {
  sockaddr_nl address{};
  address.nl_family = AF_NETLINK;
  address.nl_groups = RTMGRP_LINK | RTMGRP_IPV4_IFADDR | RTMGRP_IPV4_ROUTE;
  if (fd_ < 0 || ::bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
  ::close(fd_);
  fd_ = -1;
}

InterfaceWatch::~InterfaceWatch() {
  if (fd_ >= 0) ::close(fd_);
}

bool InterfaceWatch::TakeChanges() const {
  bool changed = false;
  std::array<char, 8192> notices{};
  while (fd_ >= 0) {
    // ENOBUFS means that notices were lost because there were too many.
    if (::recv(fd_, notices.data(), notices.size(), 0) < 0 && errno != ENOBUFS) {
      if (errno == EINTR) continue;
      return changed;
    }
    changed = true;
  }
  return changed;
}

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

class Socket {
 public:
  Socket() : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

const sockaddr* Generic(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

ProbeResult Failure(BusErrorCode code, std::string problem) {
  ProbeResult result;
  result.code = code;
  result.problem = std::move(problem);
  return result;
}

ProbeResult CannotCarry(const std::string& group, const std::string& problem) {
  const std::string fix = "ip link set lo up && ip route add " + group + "/32 dev lo";
  return Failure(BusErrorCode::kNoMulticastRoute, problem + ". As root: " + fix +
                                                      ". Without root, for one command: unshare -Urn sh -c '" + fix +
                                                      " && exec COMMAND'");
}

ProbeResult NoRoute(const std::string& group) {
  return CannotCarry(group, "no interface of this host (network namespace) carries multicast group " + group);
}

// Result if loopback is down. With TTL 0 the group needs no route, so this is the only cause.
ProbeResult LoopbackDown(const std::string& group) {
  return CannotCarry(group,
                     "the loopback interface of this host (network namespace) is down, so nothing carries "
                     "multicast group " +
                         group);
}

ProbeResult SystemFailure(const std::string& group, int port, const char* step, int error) {
  // A shortage is not caused by the network.
  if (files::IsShortage(error)) throw std::system_error(error, std::generic_category(), step);
  return Failure(BusErrorCode::kNetworkUnusable, "multicast " + group + ":" + std::to_string(port) + ": " + step +
                                                     ": " + std::strerror(error) +
                                                     "; check firewall and container network settings");
}

// Returns a short-form LCM packet on LCM's self-test channel, with content that is unique to this probe.
std::string ProbeDatagram() {
  using std::string_view_literals::operator""sv;
  std::string packet(
      "LC02\0\0\0\0"
      "LCM_SELF_TEST\0"sv);
  return packet + "legopt " + std::to_string(RandomSeed());
}

bool Arrives(int receive_fd, const std::string& expected, milliseconds patience) {
  const auto end = steady_clock::now() + patience;
  std::array<char, kMaxDatagramBytes> buffer{};
  for (;;) {
    pollfd ready{receive_fd, POLLIN, 0};
    const auto left = std::chrono::duration_cast<milliseconds>(end - steady_clock::now());
    const int count = ::poll(&ready, 1, std::max(0, static_cast<int>(left.count()) + 1));
    if (count < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category(), "poll");
    if (count <= 0) {
      // Checked only after poll(), so that a datagram that arrived during a pause of this process counts.
      if (steady_clock::now() >= end) return false;
      continue;
    }
    const ssize_t size = ::recv(receive_fd, buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size > 0 && expected == std::string_view(buffer.data(), static_cast<std::size_t>(size))) return true;
  }
}

ProbeResult Unreachable(const std::string& group, int ttl) { return ttl == 0 ? LoopbackDown(group) : NoRoute(group); }

ProbeResult BindAndJoin(int fd, const std::string& group, int ttl, sockaddr_in& address) {
  const int port = ntohs(address.sin_port);
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  if (::bind(fd, Generic(address), sizeof(address)) < 0) {
    const int error = errno;
    if (error == EADDRINUSE || error == EACCES) {
      return Failure(BusErrorCode::kPortUnusable,
                     "UDP port " + std::to_string(port) + ": " + std::strerror(error) +
                         (error == EADDRINUSE ? ": another program holds it; choose " : "; choose ") +
                         "another one with --port or LEGOPT_PORT");
    }
    return SystemFailure(group, port, "bind", error);
  }
  socklen_t length = sizeof(address);
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length);
  const int interface = ttl == 0 ? LoopbackIndex() : 0;  // 0: chosen by the route
  if (!JoinGroup(fd, address.sin_addr, interface)) {
    if (errno == ENODEV || errno == ENETUNREACH) return Unreachable(group, ttl);
    return SystemFailure(group, port, "join group", errno);
  }
  ProbeResult joined;
  joined.usable = true;
  joined.interface = InterfaceName(ttl == 0 ? interface : RouteOf(address.sin_addr));
  return joined;
}

}  // namespace

ProbeResult ProbeMulticast(const std::string& group, int port, milliseconds patience, int ttl) {
  const Socket receiver;
  const Socket sender;
  if (receiver.fd() < 0 || sender.fd() < 0) return SystemFailure(group, port, "socket", errno);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, group.c_str(), &address.sin_addr) != 1) {
    return Failure(BusErrorCode::kInvalidOption, "group: \"" + group + "\": must be an IPv4 address");
  }
  const ProbeResult result = BindAndJoin(receiver.fd(), group, ttl, address);
  if (!result.usable) return result;
  const unsigned char no_hops = 0;
  ::setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_TTL, &no_hops, sizeof(no_hops));
  if (ttl == 0 && !SendThrough(sender.fd(), LoopbackIndex())) return LoopbackDown(group);
  const std::string datagram = ProbeDatagram();
  constexpr int kTries = 4;  // a busy receiver may lose some
  for (int i = 0; i < kTries; ++i) {
    if (::sendto(sender.fd(), datagram.data(), datagram.size(), 0, Generic(address), sizeof(address)) < 0) {
      if (errno == ENETUNREACH || errno == ENODEV) return Unreachable(group, ttl);
      return SystemFailure(group, port, "send", errno);
    }
    if (Arrives(receiver.fd(), datagram, patience / kTries)) return result;
  }
  return Failure(BusErrorCode::kNetworkUnusable,
                 "multicast " + group + ":" + std::to_string(ntohs(address.sin_port)) +
                     ": packets of this host do not return to it" +
                     (result.interface.empty() ? std::string() : " (interface " + result.interface + ")") +
                     "; probably a firewall drops them: allow UDP to the group on that interface");
}

MulticastRoute ProbeMulticastRoute(const std::string& group, int ttl) {
  constexpr milliseconds kPatience(400);
  const ProbeResult result = ProbeMulticast(group, 0, kPatience, ttl);
  return {result.usable, result.interface, result.problem};
}

int FindFreePortPair(std::uint64_t seed) {
  // Below 32768, where the kernel's range of automatically assigned ports begins: the pair must still be free when it
  // is bound.
  constexpr int kLowest = 20000;
  constexpr std::uint64_t kPairs = 6384;
  constexpr int kTries = 200;
  std::mt19937_64 random(seed);
  for (int i = 0; i < kTries; ++i) {
    const int port = kLowest + 2 * static_cast<int>(random() % kPairs);
    // Without SO_REUSEADDR, bind fails if any socket uses the port, including multicast listeners.
    const Socket control;
    const Socket bulk;
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    if (::bind(control.fd(), Generic(address), sizeof(address)) < 0) continue;
    address.sin_port = htons(static_cast<std::uint16_t>(port + 1));
    if (::bind(bulk.fd(), Generic(address), sizeof(address)) < 0) continue;
    return port;
  }
  throw BusError(BusErrorCode::kPortUnusable, "no free pair of UDP ports found in 20000 - 32767");
}

}  // namespace legopt::bus
