#include "worker/uplink.h"

#include <utility>

#include "bridge/access_file.h"
#include "bus/endpoint.h"

namespace legopt::worker {
namespace {

constexpr bridge::LinkAddress kAnyAddressAndPort = 0;

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
  uplink.network.port = bus::FindFreePortPair(bus::RandomSeed());
  uplink.network.ttl = 0;
  return uplink;
}

std::unique_ptr<bridge::Bridge> RunSpoke(Uplink uplink) {
  if (!uplink.bridged()) return nullptr;
  return bridge::Bridge::RunSpoke(uplink.network, std::move(*uplink.socket), std::move(uplink.hub));
}

}  // namespace legopt::worker
