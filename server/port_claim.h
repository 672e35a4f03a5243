#pragma once

#include <optional>
#include <string>
#include <utility>

namespace legopt::server {

/// Exclusive claim of a pair of UDP ports of this machine (network namespace). It covers all multicast groups, because
/// a port receives messages of every group that any local program has joined. The claim is held during the lifetime of
/// this object by one abstract Unix socket per port; the kernel releases it however the process ends.
class PortClaim {
 public:
  /// Claims `port` and `port + 1`. Does not wait.
  explicit PortClaim(int port);
  ~PortClaim();
  PortClaim(const PortClaim&) = delete;
  PortClaim& operator=(const PortClaim&) = delete;

  /// The port claimed by another server; nullopt if both claims succeeded. Of several servers that claim a port
  /// simultaneously, exactly one succeeds: ports are claimed in ascending order.
  std::optional<int> taken() const { return taken_; }

 private:
  std::pair<int, int> sockets_{-1, -1};
  std::optional<int> taken_;
};

}  // namespace legopt::server
