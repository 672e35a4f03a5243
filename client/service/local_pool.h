#pragma once

#include <chrono>
#include <filesystem>
#include <vector>

#include "client/service/managed_pool.h"
#include "client/service/managed_program.h"
#include "client/service/managed_server.h"

namespace legopt::bus {
class MessageKey;
}

namespace legopt::client {

struct LocalPoolOptions {
  std::filesystem::path database;
  std::filesystem::path dataset;
  int slots = 2;
  NetworkOptions network;                           ///< without a port, a free pair is chosen; the key is ignored
  std::vector<std::filesystem::path> solvers = {};  ///< description files of external solvers for the worker
  std::filesystem::path offered = {};               ///< folder of packed datasets for the server; empty: none
  bool verbose = false;                             ///< let the children write to this process's standard error
};

/// An ManagedPool on this machine: the programs beside this one run as child processes. Its key exists only in memory
/// and is passed to the children by an inherited descriptor, so that other users cannot command the pool. The worker,
/// which starts external solvers, gets only the worker's key. A child killed by a signal is restarted (the database and
/// the leases make that safe). A child that exits by itself is an error: kInterrupted if another process ordered it to
/// stop. The destructor stops both children.
class LocalPool final : public ManagedPool {
 public:
  /// Starts the server, waits until it serves, and starts the worker. Throws the errors of ManagedServer.
  explicit LocalPool(LocalPoolOptions options);
  ~LocalPool() override;

  const NetworkOptions& network() const override { return server_.network(); }
  void Supervise() override;
  void Stop(std::chrono::milliseconds patience) override;

 private:
  LocalPool(LocalPoolOptions options, const bus::MessageKey& key);
  void StartWorker();

  LocalPoolOptions options_;
  app::Descriptor key_, worker_key_;  // key files in memory (memfd)
  ManagedServer server_;
  ManagedProgram worker_;
};

}  // namespace legopt::client
