#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/service/child_process.h"
#include "client/service/server_connection.h"

namespace legopt::client {

/// Returns the last error message that a child reported on its error output: a line "[...] [PROGRAM] [error] MESSAGE"
/// or "PROGRAM: error: MESSAGE". Empty if there is none; warnings are ignored.
std::string LastErrorMessage(const std::string& program, const std::string& tail);

/// A legopt program in the same folder that runs as part of this command. Only this process can order it to stop. It is
/// restarted if a signal killed it; exiting by itself is an error. Thread rule: one thread.
class ManagedProgram {
 public:
  /// `name`: e.g. "legopt-server". `verbose`: it writes to this process's standard error. Starts nothing.
  ManagedProgram(std::string name, bool verbose) : name_(std::move(name)), verbose_(verbose) {}

  /// Starts or restarts the program; it inherits the descriptors in `kept`. Throws ClientError (kMachine) if the
  /// program is missing.
  void Start(std::vector<std::string> arguments, std::span<const int> kept = {});
  /// True if it has been started and not been dropped.
  bool started() const { return child_ != nullptr; }
  /// Must have been started.
  ChildProcess& child() { return *child_; }
  /// Kills it if it still runs.
  void Drop() { child_.reset(); }

  /// Returns true if a signal has killed it, after a warning on standard error: the caller must restart it. Throws
  /// ClientError if it gave up (with its exit code and last error), ended orderly because another process ordered it to
  /// (kInterrupted), or was killed too often. Must have been started.
  bool WasKilled();
  /// Throws the error that explains its end. It must have ended.
  [[noreturn]] void Fail();

 private:
  std::string name_;
  bool verbose_;
  int restarts_ = 0;
  std::unique_ptr<ChildProcess> child_;
};

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

/// A server and workers that belong to one command. Thread rule: one thread.
class ManagedPool {
 public:
  virtual ~ManagedPool() = default;

  /// Address of the server, for a ServerConnection.
  virtual const NetworkOptions& network() const = 0;

  /// Must be called a few times per second. Throws ClientError if the server or the workers have given up.
  virtual void Supervise() = 0;

  /// Stops the workers, then the server, so that jobs are released and the database is closed. Running jobs get
  /// `patience` to finish; a second interruption kills immediately.
  virtual void Stop(std::chrono::milliseconds patience) = 0;
};

}  // namespace legopt::client

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
