#include "client/pool/server_check.h"

#include <chrono>
#include <thread>

#include "bus/bridge/access_file.h"
#include "bus/bridge/bridge.h"
#include "bus/bridge/link_socket.h"
#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "client/client_error.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds kPatience{3000}, kInterval{20};
constexpr bridge::LinkAddress kAnyAddressAndPort = 0;

}  // namespace

void RequireServer(const std::string& access_file, bus::LcmOptions network) {
  const bridge::Access access = bridge::ReadAccessFile(access_file);
  if (!network.key_file.empty()) network.key = bus::MessageKey::Load(network.key_file);
  if (!bus::ProbeMulticastRoute(network.group).usable) return;
  network.deployment = access.deployment;
  network.ttl = 0;
  network.port = bus::FindFreePortPair(bus::RandomSeed());
  const auto spoke = bridge::Bridge::RunSpoke(network, bridge::LinkSocket(kAnyAddressAndPort), access.addresses);
  for (const auto end = Clock::now() + kPatience; !spoke->linked();) {
    if (Clock::now() >= end) {
      const std::string key = network.key_file.empty() ? " without a key" : " under the key in " + network.key_file;
      throw ClientError(ExitCode::kUnreachable,
                        access_file + ": no server answers" + key + " at " + bridge::ListOf(access.addresses) +
                            "; is legopt-server running with --listen, is it the server's key (--key-file), and does a "
                            "firewall let UDP to that port pass?");
    }
    std::this_thread::sleep_for(kInterval);
  }
}

}  // namespace legopt::client
