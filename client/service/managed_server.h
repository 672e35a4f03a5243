#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/service/managed_program.h"
#include "client/service/server_connection.h"

namespace legopt::client {

/// Options of a command's own server.
struct OwnServerOptions {
  std::filesystem::path database;
  NetworkOptions network;               ///< without a port, a free pair is chosen; each run is a separate deployment
  std::vector<std::string> extra = {};  ///< further arguments, e.g. --listen
  bool verbose = false;                 ///< let it write to this process's standard error
  std::vector<int> kept = {};           ///< inherited descriptors
};

/// A command's own server, a child process on this machine. The destructor stops it. Thread rule: one thread.
class ManagedServer {
 public:
  /// Starts the server and waits until it serves. Throws ClientError: the exit code and last error of a server that
  /// gave up, kInterrupted under an InterruptGuard, kMachine if the program is missing.
  explicit ManagedServer(OwnServerOptions options);
  ~ManagedServer() { Stop(); }
  ManagedServer(const ManagedServer&) = delete;
  ManagedServer& operator=(const ManagedServer&) = delete;

  /// Address of the server.
  const NetworkOptions& network() const { return options_.network; }

  /// Must be called a few times per second: restarts a server killed by a signal, at the same address. Throws the
  /// errors of the constructor.
  void Supervise();
  /// Stops the server orderly, so that the database is closed; a second interruption kills immediately.
  void Stop();

 private:
  void Start();
  bool TryStart();

  OwnServerOptions options_;
  ManagedProgram program_;
};

}  // namespace legopt::client
