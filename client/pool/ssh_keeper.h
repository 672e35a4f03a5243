#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/pool/ssh_pool.h"

/// @file
/// The process that keeps a pool of connections ('legopt pool ssh'), as others see it: who it is, what it last said of
/// its hosts, and how it is told to stop.

namespace legopt::client {

/// A process, told from later ones of its number by when it was started.
class Keeper {
 public:
  static Keeper ThisProcess();
  /// Of a line of the record; empty when it is none.
  static std::optional<Keeper> FromId(const std::string& id);

  int pid() const { return pid_; }
  std::string id() const { return std::to_string(pid_) + " " + std::to_string(started_); }
  bool runs() const;
  /// Orders it to stop, waits for so long, orders it to give back what runs, waits a moment, and kills it. Returns
  /// early with it killed when `give_up` says so.
  void Stop(std::chrono::milliseconds patience, bool (*give_up)() = nullptr) const;

 private:
  Keeper(int pid, std::uint64_t started) : pid_(pid), started_(started) {}
  bool EndsWithin(std::chrono::milliseconds duration, bool (*give_up)()) const;

  int pid_;
  std::uint64_t started_;
};

/// The hosts of a keeper in the pool's folder. Each keeper has a file of its own: several may use one folder.
class HostsFile {
 public:
  HostsFile(const std::filesystem::path& folder, const Keeper& keeper);
  /// Writes the states that `legopt pool status` shows, in one step. Does nothing where the file cannot be written.
  void Write(const std::vector<SshPool::Host>& hosts) const;
  /// The states of the last Write; empty if the file cannot be read.
  std::vector<SshPool::Host> Read() const;
  /// Removes the file. Does nothing if there is none.
  void Remove() const;

 private:
  std::filesystem::path path_;
};

}  // namespace legopt::client
