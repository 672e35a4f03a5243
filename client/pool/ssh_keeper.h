#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/ssh_pool.h"

/// @file
/// The process that keeps a pool of ssh connections ('legopt pool ssh'), as seen by other commands: its identity, its
/// last report about its hosts, and how to stop it.

namespace legopt::client {

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
