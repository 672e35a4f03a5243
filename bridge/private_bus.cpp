#include "bridge/private_bus.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <net/if.h>
#include <net/route.h>
#include <netinet/in.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "bus/lcm_transport.h"

namespace legopt::bridge {
namespace {

constexpr char kLoopbackName[] = "lo";

std::string Refused(const char* step) { return std::string(step) + ": " + std::strerror(errno); }

bool WriteWhole(const char* file, const std::string& text) {
  const int fd = ::open(file, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  ::close(fd);
  return written;
}

// Root needs no user namespace, and would lose its rights to the files of others in one.
std::string Unshare() {
  if (::unshare(CLONE_NEWNET) == 0) return "";
  const std::string user = std::to_string(::geteuid()), group = std::to_string(::getegid());
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return Refused("unshare");
  const bool mapped = WriteWhole("/proc/self/setgroups", "deny") &&
                      WriteWhole("/proc/self/uid_map", user + " " + user + " 1") &&
                      WriteWhole("/proc/self/gid_map", group + " " + group + " 1");
  return mapped ? "" : Refused("map of users");
}

std::string RouteOverLoopback(const std::string& group) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return Refused("socket");
  ifreq loopback{};
  std::memcpy(loopback.ifr_name, kLoopbackName, sizeof kLoopbackName);
  loopback.ifr_flags = IFF_UP | IFF_RUNNING;
  rtentry route{};
  std::array<char, sizeof kLoopbackName> device{};
  std::memcpy(device.data(), kLoopbackName, sizeof kLoopbackName);
  sockaddr_in destination{};
  destination.sin_family = AF_INET;
  ::inet_pton(AF_INET, group.c_str(), &destination.sin_addr);
  std::memcpy(&route.rt_dst, &destination, sizeof destination);
  route.rt_flags = RTF_UP | RTF_HOST;
  route.rt_dev = device.data();
  const bool up = ::ioctl(fd, SIOCSIFFLAGS, &loopback) == 0;
  const bool routed = up && (::ioctl(fd, SIOCADDRT, &route) == 0 || errno == EEXIST);
  const std::string refused = routed ? "" : Refused(up ? "route over loopback" : "loopback");
  ::close(fd);
  return refused;
}

std::string Enter(const std::string& group) {
  if (const std::string refused = Unshare(); !refused.empty()) return refused;
  if (const std::string refused = RouteOverLoopback(group); !refused.empty()) return refused;
  return bus::ProbeMulticastRoute(group).problem;
}

// There is no way back out of a namespace: a process that is thrown away goes first.
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

std::string EnterPrivateBus(const std::string& group) {
  if (const std::string refused = Try(group); !refused.empty()) return refused;
  // A change of user namespace may take back the signal that ends us with our parent.
  int signal_of_the_parents_end = 0;
  ::prctl(PR_GET_PDEATHSIG, &signal_of_the_parents_end);
  const std::string refused = Enter(group);
  ::prctl(PR_SET_PDEATHSIG, signal_of_the_parents_end);
  return refused;
}

}  // namespace legopt::bridge
