#include "client/pool/worker_key.h"

#include <memory>

#include "bus/bus_error.h"
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

}  // namespace legopt::client
