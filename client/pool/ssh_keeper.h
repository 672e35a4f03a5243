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
class Keeper {
 public:
  static Keeper ThisProcess();
  /// Parses the id of a line of the record; nullopt if invalid.
  static std::optional<Keeper> FromId(const std::string& id);

  std::string id() const { return std::to_string(pid_) + " " + std::to_string(started_); }
  bool runs() const;
  /// Orders the process to stop, waits for `patience`, orders it to release running jobs, waits a moment, and kills it.
  /// If `give_up` returns true, kills it and returns early.
  void Stop(std::chrono::milliseconds patience, bool (*give_up)() = nullptr) const;

 private:
  Keeper(int pid, std::uint64_t started) : pid_(pid), started_(started) {}
  bool EndsWithin(std::chrono::milliseconds duration, bool (*give_up)()) const;

  int pid_;
  std::uint64_t started_;
};

/// Writes the hosts' states for 'legopt pool status' into the pool's folder, atomically. Write errors are ignored.
void TellHosts(const std::filesystem::path& folder, const std::vector<SshPool::Host>& hosts);
/// Returns the hosts written by the last TellHosts; empty if there is no readable file.
std::vector<SshPool::Host> ToldHosts(const std::filesystem::path& folder);

}  // namespace legopt::client
