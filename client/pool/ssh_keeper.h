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

/// Writes what status shows into the pool's folder, in one step. What cannot be written is not shown.
void TellHosts(const std::filesystem::path& folder, const std::vector<SshPool::Host>& hosts);
/// Of the last TellHosts; empty when there is nothing to be read.
std::vector<SshPool::Host> ToldHosts(const std::filesystem::path& folder);

}  // namespace legopt::client
