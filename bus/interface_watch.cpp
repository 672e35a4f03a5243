#include "bus/interface_watch.h"

#include <linux/rtnetlink.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>

namespace legopt::bus {

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

}  // namespace legopt::bus
