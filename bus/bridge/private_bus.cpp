#include "bus/bridge/private_bus.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "bus/lcm_transport.h"
#include "bus/network_namespace.h"

namespace legopt::bridge {
namespace {

constexpr char kLoopbackName[] = "lo";

std::string Refused(const char* step) { return std::string(step) + ": " + std::strerror(errno); }

std::string RouteOverLoopback(const std::string& group) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Refused("socket");
  rtentry route{};
  std::array<char, sizeof kLoopbackName> device{};
  std::memcpy(device.data(), kLoopbackName, sizeof kLoopbackName);
  sockaddr_in destination{};
  destination.sin_family = AF_INET;
  ::inet_pton(AF_INET, group.c_str(), &destination.sin_addr);
  std::memcpy(&route.rt_dst, &destination, sizeof destination);
  route.rt_flags = RTF_UP | RTF_HOST;
  route.rt_dev = device.data();
  const bool routed = ::ioctl(fd, SIOCADDRT, &route) == 0 || errno == EEXIST;
  const std::string refused = routed ? "" : Refused("route over loopback");
  ::close(fd);
  return refused;
}

std::string Enter(const std::string& group) {
  if (const std::string refused = bus::EnterNetworkNamespace(); !refused.empty()) return refused;
  if (const std::string refused = bus::RaiseLoopback(); !refused.empty()) return refused;
  if (const std::string refused = RouteOverLoopback(group); !refused.empty()) return refused;
  return bus::ProbeMulticastRoute(group).problem;
}

// Tests in a child process whether the namespace can be created, because a process cannot leave a namespace again.
std::string Try(const std::string& group) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return Refused("pipe");
  const pid_t scout = ::fork();
  if (scout < 0) return Refused("fork");
  if (scout == 0) {
    const std::string refused = Enter(group);
    const bool told = ::write(ends[1], refused.data(), refused.size()) == static_cast<ssize_t>(refused.size());
    ::_exit(told && refused.empty() ? 0 : 1);
  }
  ::close(ends[1]);
  std::array<char, 500> text{};
  const ssize_t bytes = ::read(ends[0], text.data(), text.size());
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(scout, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
  return bytes > 0 ? std::string(text.data(), static_cast<std::size_t>(bytes)) : "the attempt ended without a word";
}

}  // namespace

std::string EnterIsolatedNetwork(const std::string& group) {
  if (const std::string refused = Try(group); !refused.empty()) return refused;
  // Entering a user namespace may clear the signal that ends this process when its parent ends.
  int signal_of_the_parents_end = 0;
  ::prctl(PR_GET_PDEATHSIG, &signal_of_the_parents_end);
  const std::string refused = Enter(group);
  ::prctl(PR_SET_PDEATHSIG, signal_of_the_parents_end);
  return refused;
}

}  // namespace legopt::bridge
