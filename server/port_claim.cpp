#include "server/port_claim.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

namespace legopt::server {
namespace {

// Returns a socket bound to the port's name, or -1 if another process has that name. If the kernel does not support
// abstract sockets, returns an unbound socket: no process can claim a port there, and the probe on the bus remains.
int Claim(int port) {
  const int descriptor = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const std::string name = "legopt-server/udp/" + std::to_string(port);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  // A leading zero byte makes the name abstract, without a file.
  std::memcpy(address.sun_path + 1, name.data(), name.size());
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + name.size());
  if (::bind(descriptor, reinterpret_cast<const sockaddr*>(&address), length) == 0 || errno != EADDRINUSE) {
    return descriptor;
  }
  ::close(descriptor);
  return -1;
}

}  // namespace

PortClaim::PortClaim(int port) : sockets_{Claim(port), -1} {
  if (sockets_.first < 0) {
    taken_ = port;
    return;
  }
  sockets_.second = Claim(port + 1);
  if (sockets_.second < 0) taken_ = port + 1;
}

PortClaim::~PortClaim() {
  for (const int descriptor : {sockets_.first, sockets_.second}) {
    if (descriptor >= 0) ::close(descriptor);
  }
}

}  // namespace legopt::server
