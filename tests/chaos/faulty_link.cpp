// Carries the datagrams of bridges between spokes and a hub of this machine and injects faults, like a router that
// gives each spoke an address of its own. Needs no privileges.

#include <poll.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "bus/bridge/bridge.h"
#include "tests/chaos/fault_injector.h"
#include "tests/guarded_main.h"

namespace legopt::chaos {
namespace {

using LinkClock = std::chrono::steady_clock;
using bridge::LinkAddress;
using bridge::LinkSocket;

class FaultyLink {
 public:
  FaultyLink(LinkAddress listen, LinkAddress hub, const InjectedFaultRates& options)
      : hub_(hub), injector_(options), near_(listen) {}

  void Run() {
    for (;;) {
      std::vector<pollfd> descriptors{{near_.descriptor(), POLLIN, 0}};
      for (const auto& [spoke, socket] : far_) descriptors.push_back({socket->descriptor(), POLLIN, 0});
      ::poll(descriptors.data(), descriptors.size(), WaitTime_ms());
      Take(near_, [this](LinkAddress from) { return Way{&FarOf(from), hub_}; });
      for (const auto& [spoke, socket] : far_) {
        Take(*socket, [this, to = spoke](LinkAddress /*from*/) { return Way{&near_, to}; });
      }
      SendDue();
    }
  }

 private:
  struct Way {
    const LinkSocket* by;
    LinkAddress to;
  };
  struct Letter {
    Way way;
    std::string bytes;
  };

  static LinkSocket AnyPort(LinkAddress like) { return LinkSocket(like & ~LinkAddress{0xFFFF}); }

  // Returns the socket by which the hub sees this spoke.
  const LinkSocket& FarOf(LinkAddress spoke) {
    auto& socket = far_[spoke];
    if (socket == nullptr) socket = std::make_unique<LinkSocket>(AnyPort(hub_));
    return *socket;
  }

  template <class FindWay>
  void Take(const LinkSocket& socket, FindWay find_way) {
    std::array<std::uint8_t, 2048> room{};
    LinkAddress from = 0;
    while (const std::size_t bytes = socket.Receive(room, from)) {
      for (const auto delay : injector_.Delays()) {
        under_way_.emplace(LinkClock::now() + delay,
                           Letter{find_way(from), std::string(room.begin(), room.begin() + bytes)});
      }
    }
  }

  void SendDue() {
    while (!under_way_.empty() && under_way_.begin()->first <= LinkClock::now()) {
      const Letter letter = std::move(under_way_.begin()->second);
      under_way_.erase(under_way_.begin());
      letter.way.by->Send(letter.way.to,
                          {reinterpret_cast<const std::uint8_t*>(letter.bytes.data()), letter.bytes.size()});
    }
  }

  int WaitTime_ms() const {
    if (under_way_.empty()) return -1;
    const auto wait = std::chrono::ceil<std::chrono::milliseconds>(under_way_.begin()->first - LinkClock::now());
    return static_cast<int>(std::max<std::int64_t>(wait.count(), 0));
  }

  LinkAddress hub_;
  FaultInjector injector_;
  LinkSocket near_;  // address that spokes send to
  std::map<LinkAddress, std::unique_ptr<LinkSocket>> far_;
  std::multimap<LinkClock::time_point, Letter> under_way_;
};

int LinkMain(int argc, char** argv) {
  std::string hub, listen;
  InjectedFaultRates options;
  CLI::App app("Carries datagrams between bridges and injures them.");
  app.add_option("--hub", hub, "ADDRESS:PORT of the hub")->required();
  app.add_option("--listen", listen, "ADDRESS:PORT for spokes")->required();
  AddFaultRateOptions(app, options);
  CLI11_PARSE(app, argc, argv);
  FaultyLink link(bridge::ParseLinkAddress(listen), bridge::ParseLinkAddress(hub), options);
  std::cout << "link ready" << std::endl;
  link.Run();
  return 0;
}

}  // namespace
}  // namespace legopt::chaos

int main(int argc, char** argv) { return legopt::GuardedMain(argc, argv, legopt::chaos::LinkMain); }
