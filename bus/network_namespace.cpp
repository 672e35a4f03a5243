#include "bus/network_namespace.h"

#include <fcntl.h>
#include <net/if.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace legopt::bus {
namespace {

std::string RefusedStep(const char* step) { return std::string(step) + ": " + std::strerror(errno); }

bool WriteWhole(const char* file, const std::string& text) {
  const int fd = ::open(file, O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  ::close(fd);
  return written;
}

}  // namespace

// Root needs no user namespace. In one, it would lose access to other users' files.
std::string EnterNetworkNamespace() {
  if (::unshare(CLONE_NEWNET) == 0) return "";
  const std::string user = std::to_string(::geteuid()), group = std::to_string(::getegid());
  if (::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) return RefusedStep("unshare");
  const bool mapped = WriteWhole("/proc/self/setgroups", "deny") &&
                      WriteWhole("/proc/self/uid_map", user + " " + user + " 1") &&
                      WriteWhole("/proc/self/gid_map", group + " " + group + " 1");
  return mapped ? "" : RefusedStep("map of users");
}

std::string RaiseLoopback() {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) return RefusedStep("socket");
  ifreq loopback{};
  std::memcpy(loopback.ifr_name, "lo", sizeof "lo");
  loopback.ifr_flags = IFF_UP | IFF_RUNNING;
  const std::string refused = ::ioctl(fd, SIOCSIFFLAGS, &loopback) == 0 ? "" : RefusedStep("loopback");
  ::close(fd);
  return refused;
}

}  // namespace legopt::bus
