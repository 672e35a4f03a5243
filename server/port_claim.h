#pragma once

#include <optional>
#include <string>
#include <utility>

namespace legopt::server {

/// The right to be the one server on a pair of UDP ports of this machine (network namespace), whatever the multicast
/// group: a port hears every group that any program here has joined. Held while this object lives, by one abstract Unix
/// socket per port; the kernel releases it however the process ends.
class PortClaim {
 public:
  /// Claims `port` and `port + 1`. Does not wait.
  explicit PortClaim(int port);
  ~PortClaim();
  PortClaim(const PortClaim&) = delete;
  PortClaim& operator=(const PortClaim&) = delete;

  /// The port that another server holds; empty when both are ours. Two servers that want a port at the same instant
  /// cannot both get it, and of several one always succeeds: ports are taken in ascending order.
  std::optional<int> taken() const { return taken_; }

 private:
  std::pair<int, int> sockets_{-1, -1};
  std::optional<int> taken_;
};

}  // namespace legopt::server
