#include "client/service/local_pool.h"

#include <array>
#include <csignal>
#include <string>
#include <utility>
#include <vector>

#include "bus/message_key.h"
#include "client/service/interrupt.h"

namespace legopt::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kWorkerLeave{3'000};

std::string NameOf(const app::Descriptor& file) { return "/dev/fd/" + std::to_string(file.get()); }

NetworkOptions WithKey(NetworkOptions network, const app::Descriptor& key) {
  network.key_file = NameOf(key);
  return network;
}

}  // namespace

LocalPool::LocalPool(LocalPoolOptions options) : LocalPool(std::move(options), *bus::MessageKey::Random()) {}

LocalPool::LocalPool(LocalPoolOptions options, const bus::MessageKey& key)
    : options_(std::move(options)),
      key_(key.WriteInMemory()),
      worker_key_(key.ForRole(bus::KeyRole::kWorker)->WriteInMemory()),
      server_({options_.database,
               WithKey(options_.network, key_),
               options_.offered.empty() ? std::vector<std::string>()
                                        : std::vector<std::string>{"--datasets", options_.offered.string()},
               options_.verbose,
               {key_.get()}}),
      worker_("legopt-worker", options_.verbose) {
  StartWorker();
}

LocalPool::~LocalPool() { Stop(milliseconds(0)); }

void LocalPool::StartWorker() {
  std::vector<std::string> arguments = {"--slots",    std::to_string(options_.slots),
                                        "--dataset",  options_.dataset.string(),
                                        "--group",    *network().group,
                                        "--port",     std::to_string(*network().port),
                                        "--ttl",      "0",
                                        "--key-file", NameOf(worker_key_),
                                        "--name",     "local"};
  for (const std::filesystem::path& solver : options_.solvers) {
    arguments.insert(arguments.end(), {"--solver", solver.string()});
  }
  const std::array<int, 1> kept{worker_key_.get()};
  worker_.Start(std::move(arguments), kept);
}

void LocalPool::Supervise() {
  server_.Supervise();
  if (worker_.WasKilled()) StartWorker();
}

void LocalPool::Stop(milliseconds patience) {
  if (worker_.started()) {
    // The worker finishes running jobs and takes no new ones. SIGINT instead of SIGTERM: pending signals of one kind
    // are merged, and a SIGTERM from another process is ignored.
    worker_.child().Signal(SIGINT);
    if (!worker_.child().Wait(patience, InterruptedTwice)) {
      worker_.child().Stop(kWorkerLeave, InterruptedTwice);  // a second interruption kills immediately
    }
    worker_.Drop();
  }
  server_.Stop();
}

}  // namespace legopt::client
