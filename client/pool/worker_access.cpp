#include "client/pool/worker_access.h"

#include <chrono>
#include <memory>
#include <thread>

#include "bus/bridge/bridge.h"
#include "bus/bridge/uplink.h"
#include "bus/bus_error.h"
#include "bus/endpoint.h"
#include "bus/message_key.h"
#include "client/client_error.h"

namespace legopt::client {
namespace {

namespace fs = std::filesystem;

constexpr char kFileName[] = "worker.key";

const bus::MessageKey& WorkerKeyOf(const bus::MessageKey& key, const std::string& key_file) {
  const bus::MessageKey* worker_key = key.ForRole(bus::KeyRole::kWorker);
  if (worker_key != nullptr) return *worker_key;
  throw ClientError(ExitCode::kUsage, "key file \"" + key_file + "\": holds a " + std::string(ToString(key.role())) +
                                          "'s key; workers need the full key of the deployment, or a worker's key: "
                                          "legopt service keygen FILE --role worker --from FULL_KEY");
}

// False if another process has written the file meanwhile.
bool WriteIfNew(const bus::MessageKey& key, const fs::path& file) {
  try {
    key.WriteFile(file);
    return true;
  } catch (const bus::BusError&) {
    if (!fs::exists(fs::symlink_status(file))) throw;
    return false;
  }
}

}  // namespace

std::string WorkerKeyText(const std::string& key_file) {
  const auto key = bus::MessageKey::Load(key_file);
  return WorkerKeyOf(*key, key_file).FileText();
}

fs::path WorkerKeyFile(const std::string& key_file, const fs::path& folder) {
  const auto key = bus::MessageKey::Load(key_file);
  const bus::MessageKey& worker_key = WorkerKeyOf(*key, key_file);
  if (key.get() == &worker_key) return fs::absolute(key_file).lexically_normal();
  const fs::path file = fs::absolute(folder / kFileName).lexically_normal();
  fs::create_directories(folder);
  if (!fs::exists(fs::symlink_status(file)) && WriteIfNew(worker_key, file)) return file;
  if (bus::MessageKey::Load(file)->FileText() != worker_key.FileText()) {
    throw ClientError(ExitCode::kUsage, "key file \"" + file.string() + "\": is not the worker's key of \"" + key_file +
                                            "\"; remove it, or name another --folder");
  }
  return file;
}

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
