#include "server/listening.h"

#include <iostream>
#include <utility>

#include "app/network_flags.h"
#include "app/printable.h"
#include "bus/bridge/uplink.h"
#include "bus/bus_error.h"

namespace legopt::server {

void AddListenFlags(const app::Command& command, ListenFlags* flags) {
  command
      .AddOption("--listen", flags->listen,
                 "UDP address or port on which workers of other hosts reach this server without multicast (--access)")
      .ValueName("ADDRESS:PORT")
      .Group(app::kNetworkHeading);
  command
      .AddOption("--access", flags->access,
                 "With --listen: file to write for 'legopt-worker --access' (default: the database's name and .access)")
      .ValueName("FILE")
      .Group(app::kNetworkHeading);
}

std::optional<bridge::LinkSocket> OpenListener(const ListenFlags& flags, const bus::LcmOptions& network) {
  using bus::BusError;
  using bus::BusErrorCode;
  if (!flags.listen) {
    if (flags.access) throw BusError(BusErrorCode::kInvalidOption, "--access needs --listen");
    return std::nullopt;
  }
  const bridge::LinkAddress address = bridge::ParseLinkAddress(*flags.listen);
  if (network.key_file.empty() && !network.trust_network && !bridge::IsLoopback(address)) {
    throw BusError(
        BusErrorCode::kInvalidOption,
        "--listen " + *flags.listen +
            " without a key would let everybody who reaches this address command the deployment; make a key "
            "with 'legopt service keygen FILE' for --key-file, or listen on 127.0.0.1, or say --trust-network");
  }
  return bridge::LinkSocket(address);
}

std::unique_ptr<bridge::Bridge> Listen(bridge::LinkSocket socket, const bus::LcmOptions& network,
                                       std::int64_t deployment, const std::string& access_file) {
  bridge::Access access;
  access.deployment = deployment;
  access.addresses = bridge::ReachableAddresses(socket.address());
  auto hub = bridge::Bridge::RunHub(network, std::move(socket));
  bridge::WriteAccessFile(access_file, access);
  std::cout << "legopt-server listens on " << bridge::ListOf(access.addresses) << "; access file "
            << app::Printable(access_file) << std::endl;
  return hub;
}

}  // namespace legopt::server
