#include "worker/uplink.h"

#include <utility>

#include "bridge/access_file.h"
#include "bridge/private_bus.h"
#include "bus/endpoint.h"
#include "bus/message_key.h"

namespace legopt::worker {
namespace {

constexpr bridge::LinkAddress kAnyAddressAndPort = 0;

// After all that is outside has been read and opened.
void ChooseBus(Uplink& uplink) {
  bus::LcmOptions& network = uplink.network;
  if (!network.key_file.empty()) network.key = bus::MessageKey::Load(network.key_file);
  const std::string refused = bridge::EnterPrivateBus(network.group);
  if (refused.empty()) {
    uplink.bus = "in a network namespace of its own";
    return;
  }
  network.port = bus::FindFreePortPair(bus::RandomSeed());
  uplink.bus = "on ports " + std::to_string(network.port) + " and " + std::to_string(network.port + 1) +
               " of this machine, as there is no network namespace to be had (" + refused + ")";
}

}  // namespace

Uplink FindUplink(const bus::LcmOptions& network, const std::optional<std::string>& access_file) {
  Uplink uplink;
  uplink.network = network;
  if (!access_file) {
    uplink.server_address = network.group + ":" + std::to_string(network.port);
    return uplink;
  }
  const bridge::Access access = bridge::ReadAccessFile(*access_file);
  uplink.hub = access.addresses;
  uplink.server_address = bridge::ListOf(access.addresses) + " (" + *access_file + ")";
  uplink.socket.emplace(kAnyAddressAndPort);
  uplink.network.deployment = access.deployment;
  uplink.network.ttl = 0;
  ChooseBus(uplink);
  return uplink;
}

std::unique_ptr<bridge::Bridge> RunSpoke(Uplink uplink) {
  if (!uplink.bridged()) return nullptr;
  return bridge::Bridge::RunSpoke(uplink.network, std::move(*uplink.socket), std::move(uplink.hub));
}

}  // namespace legopt::worker
