// One server per deployment: how a server finds out, before it serves and while it does, that it is the only one.
// Thread rule: the endpoint's thread. Source: PROTOCOL.md, section 4.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "bus/endpoint.h"
#include "bus/messages.h"

namespace legopt::server {

using bus::microseconds;

/// "process 12 on host with database /path", of a probe's answer; another sentence when it is none.
std::string DescribeServer(const bus::CallResult& answer);

/// A server that is about to start asks servers that serve (address 1) and servers that are about to start
/// (bus::kServerCandidate) who they are. Of several candidates that hear each other the one with the smallest instance
/// goes on: it answers the others, and they give way.
class Candidacy {
 public:
  /// `endpoint` has the address bus::kServerCandidate and outlives this object. `self` is what the server would answer
  /// to a probe. Asks for `patience`.
  Candidacy(bus::Endpoint& endpoint, legopt_msg::probe_reply self, microseconds patience);
  ~Candidacy();
  Candidacy(const Candidacy&) = delete;
  Candidacy& operator=(const Candidacy&) = delete;

  /// Another server was found, or the patience is over.
  bool over() const { return open_calls_ == 0 || !other_.empty(); }
  /// The other server, for an error message; empty: none.
  const std::string& other() const { return other_; }

 private:
  void Ask(bus::EndpointId to, microseconds patience);
  void Answer(const bus::Request& request, bus::Responder responder);

  bus::Endpoint& endpoint_;
  legopt_msg::probe_reply self_;
  int open_calls_ = 0;
  std::string other_;
};

/// Looks for another server of the deployment at regular intervals, by calling the server's own address: only another
/// server answers (this one must leave probes with its own instance as nonce unanswered). Of two servers that see each
/// other the one with the larger instance is to stop.
class RivalWatch {
 public:
  /// `endpoint` is the server's and outlives this object.
  RivalWatch(bus::Endpoint& endpoint, std::int64_t instance, microseconds interval = std::chrono::seconds(5));
  ~RivalWatch();
  RivalWatch(const RivalWatch&) = delete;
  RivalWatch& operator=(const RivalWatch&) = delete;

  /// To be called now and then, after polling; starts the next call when it is due.
  void Look();
  /// The server before which this one must stop; empty: none.
  const std::string& rival() const { return rival_; }

 private:
  bus::Endpoint& endpoint_;
  std::int64_t instance_;
  microseconds interval_;
  microseconds next_;
  bus::CallId call_ = 0;
  std::string rival_;
};

/// What stands in the way of a server on this transport, and the fix; empty: nothing. Asks for `patience` of the
/// transport's clock, before an endpoint serves there. For transports whose Poll waits, not simulated ones.
std::string FindObstacle(bus::Transport& transport, std::uint64_t seed, const legopt_msg::probe_reply& self,
                         microseconds patience);

}  // namespace legopt::server
