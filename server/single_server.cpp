#include "server/single_server.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

#include "bus/codec.h"

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

namespace {

constexpr int kAsksPerPatience = 8;

bus::CallOptions AskFor(microseconds patience) {
  bus::CallOptions options;
  options.timeout = patience;
  options.first_retry = patience / kAsksPerPatience;
  options.max_retry = options.first_retry;
  return options;
}

std::string ProbeOf(std::int64_t instance) {
  legopt_msg::probe_request request{};
  request.nonce = instance;
  return bus::Encode(std::move(request));
}

}  // namespace

std::string DescribeServer(const bus::CallResult& answer) {
  const auto reply = bus::Decode<legopt_msg::probe_reply>(answer.body);
  if (!reply) return "a server of another protocol version";
  return "process " + std::to_string(reply->pid) + " on " + reply->hostname + " with database " + reply->database;
}

ServerElection::ServerElection(bus::Endpoint& endpoint, legopt_msg::probe_reply self, microseconds patience)
    : endpoint_(endpoint), self_(std::move(self)) {
  endpoint_.Serve(bus::MessageType::kProbe,
                  [this](bus::Request&& request, bus::Responder responder) { Answer(request, std::move(responder)); });
  Ask(bus::kServer, patience);
  Ask(bus::kServerCandidate, patience);
}

ServerElection::~ServerElection() { endpoint_.Serve(bus::MessageType::kProbe, {}); }

void ServerElection::Ask(bus::EndpointId to, microseconds patience) {
  ++open_calls_;
  endpoint_.Call(to, bus::MessageType::kProbe, ProbeOf(self_.server_instance), AskFor(patience),
                 [this](bus::CallResult&& result) {
                   --open_calls_;
                   if (result.status != bus::CallResult::kTimeout) other_ = DescribeServer(result);
                 });
}

void ServerElection::Answer(const bus::Request& request, bus::Responder responder) {
  const auto probe = bus::Decode<legopt_msg::probe_request>(request.body);
  // This candidate receives its own probes as well.
  if (!probe || request.sender != bus::kServerCandidate || probe->nonce == self_.server_instance) return;
  if (probe->nonce > self_.server_instance) {
    responder.Reply(bus::Encode(self_));
  } else {
    other_ = "one that starts at this moment";
  }
}

DuplicateServerDetector::DuplicateServerDetector(bus::Endpoint& endpoint, std::int64_t instance, microseconds interval)
    : endpoint_(endpoint), instance_(instance), interval_(interval), next_(endpoint.now()) {}

DuplicateServerDetector::~DuplicateServerDetector() { endpoint_.Abandon(call_); }

void DuplicateServerDetector::Look() {
  if (call_ != 0 || !duplicate_.empty() || endpoint_.now() < next_) return;
  constexpr microseconds kPatience = std::chrono::seconds(1);
  call_ = endpoint_.Call(bus::kServer, bus::MessageType::kProbe, ProbeOf(instance_), AskFor(kPatience),
                         [this](bus::CallResult&& result) {
                           call_ = 0;
                           next_ = endpoint_.now() + interval_;
                           if (result.status != bus::CallResult::kOk) return;
                           const auto reply = bus::Decode<legopt_msg::probe_reply>(result.body);
                           if (reply && reply->server_instance < instance_) duplicate_ = DescribeServer(result);
                         });
}

std::string FindOtherServer(bus::Transport& transport, std::uint64_t seed, const legopt_msg::probe_reply& self,
                            microseconds patience) {
  bus::Endpoint endpoint(transport, bus::kServerCandidate, seed);
  ServerElection candidacy(endpoint, self, patience);
  while (!candidacy.over()) endpoint.Poll(patience);
  // If this process was paused, the time may be over before anything was read: handle messages received meanwhile.
  constexpr microseconds kLastLook = std::chrono::milliseconds(20);
  const microseconds end = transport.now() + kLastLook;
  do {
    endpoint.Poll(std::max(microseconds(0), end - transport.now()));
  } while (transport.now() < end && candidacy.other().empty());
  if (!candidacy.other().empty()) {
    return "another server answers there (" + candidacy.other() + "); stop it or choose another --port";
  }
  if (endpoint.counters().rejected_deployment > 0) {
    return "another deployment uses one of these two UDP ports (another multicast group, or a --port one above or "
           "below); choose another --port, at least 2 away";
  }
  return {};
}

}  // namespace legopt::server
