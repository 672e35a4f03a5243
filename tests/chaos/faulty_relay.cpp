// Carries datagrams between the port pairs of two deployments and injects faults, in both directions: each port of one
// pair is joined to the same port of the other. Parties of both sides must set one deployment number
// (LEGOPT_DEPLOYMENT), since the default follows from the port. Needs no privileges.

#include <arpa/inet.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/chaos/fault_injector.h"
#include "tests/guarded_main.h"

namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::microseconds;

struct Options {
  std::string group = "239.255.76.67";
  int near = 0;  // control ports of the two sides
  int far = 0;
  legopt::chaos::InjectedFaultRates injury;
};

constexpr int kPorts = 2;               // control and bulk
constexpr std::size_t kLargest = 2048;  // above the largest datagram of the protocol

int Require(int result, const char* what) {
  if (result < 0) throw std::runtime_error(std::string("injuring relay: ") + what + " failed");
  return result;
}

sockaddr_in Address(const std::string& group, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  inet_pton(AF_INET, group.c_str(), &address.sin_addr);
  return address;
}

const sockaddr* Raw(const sockaddr_in& address) { return reinterpret_cast<const sockaddr*>(&address); }

// Returns the membership on loopback, where parties with TTL 0 are.
ip_mreqn OnLoopback() {
  ip_mreqn loopback{};
  loopback.imr_ifindex = static_cast<int>(if_nametoindex("lo"));
  return loopback;
}

int OpenListener(const std::string& group, int port) {
  const int fd = Require(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket");
  const int yes = 1;
  Require(setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes), "SO_REUSEADDR");
  Require(setsockopt(fd, SOL_SOCKET, SO_REUSEPORT, &yes, sizeof yes), "SO_REUSEPORT");
  const int buffer = 4 << 20;
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  const sockaddr_in address = Address(group, port);
  Require(bind(fd, Raw(address), sizeof address), "bind");
  ip_mreqn membership = OnLoopback();
  membership.imr_multiaddr = address.sin_addr;
  Require(setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership), "IP_ADD_MEMBERSHIP");
  return fd;
}

// The socket is bound, so that its own datagrams are recognised when they are received again.
int OpenSender() {
  const int fd = Require(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0), "socket");
  const unsigned char ttl = 0;
  Require(setsockopt(fd, IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl), "IP_MULTICAST_TTL");
  const ip_mreqn loopback = OnLoopback();
  Require(setsockopt(fd, IPPROTO_IP, IP_MULTICAST_IF, &loopback, sizeof loopback), "IP_MULTICAST_IF");
  const sockaddr_in any = Address("0.0.0.0", 0);
  Require(bind(fd, Raw(any), sizeof any), "bind");
  return fd;
}

int PortOf(int fd) {
  sockaddr_in own{};
  socklen_t size = sizeof own;
  Require(getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size), "getsockname");
  return ntohs(own.sin_port);
}

class Relay {
 public:
  explicit Relay(const Options& options) : options_(options), injector_(options.injury), sender_(OpenSender()) {
    for (int port = 0; port < kPorts; ++port) {
      listeners_.push_back({OpenListener(options.group, options.near + port), options.far + port});
      listeners_.push_back({OpenListener(options.group, options.far + port), options.near + port});
    }
    own_port_ = PortOf(sender_);
  }

  void Run() {
    std::vector<pollfd> descriptors;
    for (const Listener& listener : listeners_) descriptors.push_back({listener.fd, POLLIN, 0});
    for (;;) {
      poll(descriptors.data(), descriptors.size(), WaitTime_ms());
      for (std::size_t i = 0; i < listeners_.size(); ++i) {
        if ((descriptors[i].revents & POLLIN) != 0) Take(listeners_[i]);
      }
      SendDue();
    }
  }

 private:
  struct Listener {
    int fd;
    int to_port;
  };
  struct Datagram {
    int to_port;
    std::string bytes;
  };

  void Take(const Listener& listener) {
    std::array<char, kLargest> buffer{};
    sockaddr_in source{};
    socklen_t size = sizeof source;
    const ssize_t bytes =
        recvfrom(listener.fd, buffer.data(), buffer.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&source), &size);
    if (bytes <= 0 || ntohs(source.sin_port) == own_port_) return;
    for (const microseconds delay : injector_.Delays()) {
      under_way_.emplace(Clock::now() + delay,
                         Datagram{listener.to_port, std::string(buffer.data(), static_cast<std::size_t>(bytes))});
    }
  }

  void SendDue() {
    while (!under_way_.empty() && under_way_.begin()->first <= Clock::now()) {
      const Datagram datagram = std::move(under_way_.begin()->second);
      under_way_.erase(under_way_.begin());
      const sockaddr_in to = Address(options_.group, datagram.to_port);
      sendto(sender_, datagram.bytes.data(), datagram.bytes.size(), 0, Raw(to), sizeof to);
    }
  }

  int WaitTime_ms() const {
    if (under_way_.empty()) return -1;
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(under_way_.begin()->first - Clock::now());
    return static_cast<int>(std::max<std::int64_t>(wait.count(), 0));
  }

  Options options_;
  legopt::chaos::FaultInjector injector_;
  int sender_;
  int own_port_ = 0;
  std::vector<Listener> listeners_;
  std::multimap<Clock::time_point, Datagram> under_way_;
};

int Main(int argc, char** argv) {
  Options options;
  CLI::App app("Carries datagrams between two pairs of multicast ports and injures them.");
  app.add_option("--group", options.group, "Multicast group of both sides")->capture_default_str();
  app.add_option("--near", options.near, "Control port of one side")->required();
  app.add_option("--far", options.far, "Control port of the other side")->required();
  legopt::chaos::AddFaultRateOptions(app, options.injury);
  CLI11_PARSE(app, argc, argv);
  Relay relay(options);
  std::cout << "relay ready" << std::endl;
  relay.Run();
  return 0;
}

}  // namespace

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, Main); }
