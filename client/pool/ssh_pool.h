#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/processes.h"
#include "client/client_error.h"
#include "client/pool/pool_file.h"
#include "client/pool/pool_script.h"
#include "client/service/child_process.h"

namespace legopt::client {

/// Workers on hosts reached by ssh, one per host. A worker lives as long as its connection: messages on the connection,
/// or its end, stop the worker, so that no worker is left behind however this process ends. The state of a connection
/// is for display; the server's leases determine whether jobs are lost. Thread rule: the thread that creates the pool
/// must outlive it.
class SshPool {
 public:
  /// State of a host's worker.
  struct Host {
    std::string name;
    std::string state;                            ///< "connected", or how it ended
    std::chrono::system_clock::time_point since;  ///< start of this state
  };

  /// Starts all workers. Each writes to `access.logs`/HOST.log. Throws ClientError (kMachine) without ssh.
  SshPool(const PoolFile& pool, const PoolAccess& access);

  /// Must be called a few times per second. Returns true if a worker has ended since the last call.
  bool Look();
  bool over() const;
  std::vector<Host> hosts() const;

  /// Orders each worker to stop: the first order lets running jobs end within `drain_s`, the second releases them.
  void OrderToStop();
  /// Closes the connections, which ends the workers.
  void Close();

  /// Failed workers with their causes; empty if none failed. Call it after over() is true.
  struct Failure {
    ExitCode code;
    std::string text;
  };
  std::vector<Failure> Failures() const;

 private:
  struct Connection {
    std::string name;
    std::filesystem::path log;
    app::Descriptor orders;  ///< standard input of the worker
    std::unique_ptr<ChildProcess> ssh;
    std::optional<ChildExit> exit = {};
    bool closed = false;  ///< set by Close()
    std::chrono::system_clock::time_point since = {};
  };

  static std::string StateOf(const Connection& connection);

  Connection Connect(const PoolFile& pool, const PoolAccess& access, const std::string& host) const;

  std::vector<Connection> connections_;
};

/// Returns the arguments of ssh for a host: timeouts for hosts that do not answer, and the options of the pool file.
std::vector<std::string> SshArguments(const PoolFile& pool, const std::string& host);

// The process that keeps a pool of ssh connections ('legopt pool ssh'), as seen by other commands: its identity, its
// last report about its hosts, and how to stop it.

/// A process, identified by its process id and start time.
class PoolProcess {
 public:
  static PoolProcess ThisProcess();
  /// Parses the id of a line of the record; nullopt if invalid.
  static std::optional<PoolProcess> FromId(const std::string& id);

  int pid() const { return pid_; }
  std::string id() const { return std::to_string(pid_) + " " + std::to_string(started_); }
  bool runs() const;
  /// Orders the process to stop, waits for `patience`, orders it to release running jobs, waits a moment, and kills it.
  /// If `give_up` returns true, kills it and returns early.
  void Stop(std::chrono::milliseconds patience, bool (*give_up)() = nullptr) const;

 private:
  PoolProcess(int pid, std::uint64_t started) : pid_(pid), started_(started) {}
  bool EndsWithin(std::chrono::milliseconds duration, bool (*give_up)()) const;

  int pid_;
  std::uint64_t started_;
};

/// File with the states of a keeper's hosts in the pool's folder. Each keeper has its own file, so several can use one
/// folder.
class HostsFile {
 public:
  HostsFile(const std::filesystem::path& folder, const PoolProcess& keeper);

  /// Writes the states for `legopt pool status`, atomically. Write errors are ignored.
  void Write(const std::vector<SshPool::Host>& hosts) const;
  /// Returns the states of the last Write; empty if the file cannot be read.
  std::vector<SshPool::Host> Read() const;
  /// Removes the file, if it exists.
  void Remove() const;

 private:
  std::filesystem::path path_;
};

}  // namespace legopt::client
