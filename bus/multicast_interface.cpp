#include "bus/multicast_interface.h"

#include <linux/rtnetlink.h>
#include <net/if.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>

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

}  // namespace legopt::bus
