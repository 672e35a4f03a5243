#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "bus/endpoint.h"
#include "bus/messages.h"

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

// Ensures that a deployment has a single server, both before a server starts to serve and while it serves. Thread rule:
// the endpoint's thread. Source: PROTOCOL.md, section 4.

using bus::microseconds;

/// Returns "process 12 on host with database /path" from the answer to a probe; another sentence if it cannot be
/// decoded.
std::string DescribeServer(const bus::CallResult& answer);

/// A starting server asks running servers (address 1) and other starting servers (bus::kServerCandidate) for their
/// identity. Of several candidates that hear each other, the one with the smallest instance continues: it answers the
/// others, and they give way.
class ServerElection {
 public:
  /// `endpoint` must have the address bus::kServerCandidate and outlive this object. `self` is this server's answer to
  /// probes. The probes time out after `patience`.
  ServerElection(bus::Endpoint& endpoint, legopt_msg::probe_reply self, microseconds patience);
  ~ServerElection();
  ServerElection(const ServerElection&) = delete;
  ServerElection& operator=(const ServerElection&) = delete;

  /// True if another server was found or `patience` has passed.
  bool over() const { return open_calls_ == 0 || !other_.empty(); }
  /// The other server, for an error message; empty if none.
  const std::string& other() const { return other_; }

 private:
  void Ask(bus::EndpointId to, microseconds patience);
  void Answer(const bus::Request& request, bus::Responder responder);

  bus::Endpoint& endpoint_;
  legopt_msg::probe_reply self_;
  int open_calls_ = 0;
  std::string other_;
};

/// Probes for another server of the deployment at regular intervals by calling the server's own address. Only another
/// server answers, because this one must not answer probes that contain its own instance as nonce. Of two servers that
/// see each other, the one with the larger instance must stop.
class DuplicateServerDetector {
 public:
  /// `endpoint` belongs to the server and must outlive this object.
  DuplicateServerDetector(bus::Endpoint& endpoint, std::int64_t instance,
                          microseconds interval = std::chrono::seconds(5));
  ~DuplicateServerDetector();
  DuplicateServerDetector(const DuplicateServerDetector&) = delete;
  DuplicateServerDetector& operator=(const DuplicateServerDetector&) = delete;

  /// Must be called regularly, after polling; starts the next call when it is due.
  void Look();
  /// The server that takes precedence over this one; empty if none.
  const std::string& rival() const { return duplicate_; }

 private:
  bus::Endpoint& endpoint_;
  std::int64_t instance_;
  microseconds interval_;
  microseconds next_;
  bus::CallId call_ = 0;
  std::string duplicate_;
};

/// Returns why a server cannot start on this transport, and the remedy; empty if it can. Probes for `patience` of the
/// transport's clock. Must be called before an endpoint serves there. Only for transports whose Poll waits, not for
/// simulated ones.
std::string FindOtherServer(bus::Transport& transport, std::uint64_t seed, const legopt_msg::probe_reply& self,
                            microseconds patience);

}  // namespace legopt::server
