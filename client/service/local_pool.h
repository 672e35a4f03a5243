#pragma once

#include <chrono>
#include <filesystem>
#include <vector>

#include "client/service/own_pool.h"
#include "client/service/own_program.h"
#include "client/service/own_server.h"

namespace legopt::bus {
class MessageKey;
}

namespace legopt::client {

struct LocalPoolOptions {
  std::filesystem::path database;
  std::filesystem::path dataset;
  int slots = 2;
  NetworkOptions network;                           ///< without a port, a free pair is chosen; its key does not count
  std::vector<std::filesystem::path> solvers = {};  ///< declarations that the worker is given
  std::filesystem::path offered = {};               ///< folder of packed datasets for the server; empty: none
  bool verbose = false;                             ///< let the children write to our standard error
};

/// An OwnPool on this machine: the programs beside this one, as child processes. Its key exists in memory only and
/// reaches the children through an inherited descriptor, so no other user can command the pool. The worker, which
/// starts external solvers, gets the worker's key. A child that a signal killed is started again (the database and the
/// leases make that safe). A child that exited by itself is an error: kInterrupted if another process ordered it to
/// stop. The destructor stops both children.
class LocalPool final : public OwnPool {
 public:
  /// Starts the server, waits until it serves, and starts the worker. Throws as OwnServer.
  explicit LocalPool(LocalPoolOptions options);
  ~LocalPool() override;

  const NetworkOptions& network() const override { return server_.network(); }
  void Supervise() override;
  void Stop(std::chrono::milliseconds patience) override;

 private:
  LocalPool(LocalPoolOptions options, const bus::MessageKey& key);
  void StartWorker();

  LocalPoolOptions options_;
  programs::Descriptor key_, worker_key_;  // key files in memory
  OwnServer server_;
  OwnProgram worker_;
};

}  // namespace legopt::client
