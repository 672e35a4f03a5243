#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/service/child_process.h"
#include "client/service/server_connection.h"

namespace legopt::client {

struct LocalPoolOptions {
  std::filesystem::path database;
  std::filesystem::path dataset;
  int slots = 2;
  NetworkOptions network;                           ///< without a port, a free pair is chosen
  std::vector<std::filesystem::path> solvers = {};  ///< declarations that the worker is given
  bool verbose = false;                             ///< let the children write to our standard error
};

/// The line of a child's error output that tells best why it gave up: the last one logged as an error, else the last
/// one; without its log prefix, "PROGRAM: " and "error: ".
std::string LastWords(const std::string& program, const std::string& tail);

/// A server and a worker pool of our own, for one command: the programs beside this one, as child processes on this
/// machine. A child that a signal killed is started again (the database and the leases make that safe); one that gave
/// up by itself is an error, kInterrupted when it ended in good order because somebody else told it to. The destructor
/// stops both. Thread rule: one thread.
class LocalPool {
 public:
  /// Starts the server, waits until it serves, and starts the worker. Throws ClientError with the exit code and the
  /// last words of a child that gave up, kInterrupted under an InterruptGuard, kInternal when a program is missing.
  explicit LocalPool(LocalPoolOptions options);
  ~LocalPool();

  /// Where the server listens; for a ServerConnection.
  const NetworkOptions& network() const { return options_.network; }

  /// To be called a few times per second. Throws as the constructor.
  void Supervise();

  /// Ends the worker, then the server: in order, so that held jobs go back and the database is closed. Running jobs get
  /// `patience` to finish; a second interruption kills at once.
  void Stop(std::chrono::milliseconds patience);

 private:
  void StartServer();
  bool TryStartServer();
  void StartWorker();
  void CountRestart(const std::string& program, const ChildExit& exit);

  LocalPoolOptions options_;
  bool chosen_port_ = false;
  int restarts_ = 0;
  std::unique_ptr<ChildProcess> server_;
  std::unique_ptr<ChildProcess> worker_;
};

}  // namespace legopt::client
