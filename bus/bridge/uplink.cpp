#include "bus/bridge/uplink.h"

#include <utility>

#include "bus/bridge/access_file.h"
#include "bus/bridge/private_bus.h"
#include "bus/endpoint.h"
#include "bus/message_key.h"

namespace legopt::bridge {
namespace {

constexpr LinkAddress kAnyAddressAndPort = 0;

// Called after everything outside the namespace has been read and opened.
void ChooseBus(ServerUplink& uplink, BusLocation place) {
  bus::LcmOptions& network = uplink.network;
  if (!network.key_file.empty()) network.key = bus::MessageKey::Load(network.key_file);
  std::string why_not;
  if (place == BusLocation::kOwnNamespace) {
    const std::string refused = EnterIsolatedNetwork(network.group);
    if (refused.empty()) {
      uplink.bus = "in a network namespace of its own";
      return;
    }
    why_not = ", as there is no network namespace to be had (" + refused + ")";
  }
  network.port = bus::FindFreePortPair(bus::RandomSeed());
  uplink.bus = "on ports " + std::to_string(network.port) + " and " + std::to_string(network.port + 1) +
               " of this machine" + why_not;
}

}  // namespace

ServerUplink PrepareUplink(const bus::LcmOptions& network, const std::optional<std::string>& access_file,
                           BusLocation place) {
  ServerUplink uplink;
  uplink.network = network;
  if (!access_file) {
    uplink.server_address = network.group + ":" + std::to_string(network.port);
    return uplink;
  }
  const Access access = ReadAccessFile(*access_file);
  uplink.hub = access.addresses;
  uplink.server_address = ListOf(access.addresses) + " (" + *access_file + ")";
  uplink.socket.emplace(kAnyAddressAndPort);
  uplink.network.deployment = access.deployment;
  uplink.network.ttl = 0;
  ChooseBus(uplink, place);
  return uplink;
}

std::unique_ptr<Bridge> RunSpoke(ServerUplink uplink) {
  if (!uplink.bridged()) return nullptr;
  return Bridge::RunSpoke(uplink.network, std::move(*uplink.socket), std::move(uplink.hub));
}

}  // namespace legopt::bridge
