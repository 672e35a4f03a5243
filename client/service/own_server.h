#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "client/service/own_program.h"
#include "client/service/server_connection.h"

namespace legopt::client {

/// The server of one command.
struct OwnServerOptions {
  std::filesystem::path database;
  NetworkOptions network;               ///< without a port, a free pair is chosen; a run is a deployment of its own
  std::vector<std::string> extra = {};  ///< further arguments, e.g. --listen
  bool verbose = false;                 ///< let it write to our standard error
  std::vector<int> kept = {};           ///< descriptors that it inherits
};

/// A server of our own, for one command, as a child process on this machine. The destructor stops it. Thread rule: one
/// thread.
class OwnServer {
 public:
  /// Starts it and waits until it serves. Throws ClientError with the exit code and the last words of one that gave up,
  /// kInterrupted under an InterruptGuard, kMachine when the program is missing.
  explicit OwnServer(OwnServerOptions options);
  ~OwnServer() { Stop(); }
  OwnServer(const OwnServer&) = delete;
  OwnServer& operator=(const OwnServer&) = delete;

  /// Where it listens.
  const NetworkOptions& network() const { return options_.network; }

  /// To be called a few times per second: starts one that a signal killed again, at the same place. Throws as the
  /// constructor.
  void Supervise();
  /// In order, so that the database is closed; a second interruption kills at once.
  void Stop();

 private:
  void Start();
  bool TryStart();

  OwnServerOptions options_;
  OwnProgram program_;
};

}  // namespace legopt::client
