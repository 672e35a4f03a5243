#pragma once

#include <spdlog/logger.h>

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "worker/child_process.h"
#include "worker/pool.h"
#include "worker/server_link.h"

namespace legopt::worker {

struct SupervisorOptions {
  PoolOptions pool;
  /// Program and arguments of a job process, which gets its socket as ChildProcess::kSocket.
  std::vector<std::string> child_command;
  /// Processor to which the job process of each slot is pinned; empty: none.
  std::vector<int> slot_processors = {};
};

/// Runs a worker: performs the actions of its Pool on job processes and over the link to the server, and reports events
/// to the pool. Makes no decisions itself.
///
/// All job processes have ended when Run has returned or thrown. One thread; the link and logger must outlive this
/// object.
class Supervisor {
 public:
  Supervisor(ServerLink& link, SupervisorOptions options, spdlog::logger& logger);
  ~Supervisor();

  /// Runs until the end of the worker and returns its exit code. When `stop_fd` is readable, `take_order` takes one
  /// order to stop and returns false if there is none. -1: no orders.
  ExitCode Run(int stop_fd = -1, const std::function<bool()>& take_order = {});

  const Pool& pool() const { return pool_; }
  /// Returns the process of a slot; -1 if there is none.
  pid_t child_pid(int slot) const;

 private:
  struct Child {
    std::unique_ptr<ChildProcess> process;
    bool output_ignored = false;            // violated the protocol: its output is ignored
    std::optional<microseconds> closed_at;  // time when it closed its socket; it should end soon
  };

  // Performs all pending actions. Returns the exit code if the worker is done.
  std::optional<ExitCode> CarryOutActions();
  void CarryOut(const StartChild& action);
  void CarryOut(const AssignJob& action);
  void CarryOut(const CancelJob& action);
  void CarryOut(const KillChild& action);
  template <class Call>
  void CarryOut(const Call& action) {
    calls_.CarryOut(action);
  }
  void CarryOut(const LogLine& action);
  void CarryOut(const ExitWorker& action);

  void EndChildren();
  void HandleChild(int slot, std::span<const pollfd> ready);
  void ReadFrames(int slot);
  void HandleFrame(int slot, const Frame& frame);
  void Garbage(int slot, const std::string& why);
  void ForwardLog(int slot, ChildProcess& process);
  microseconds WaitTime() const;
  Child& child(int slot) { return children_[static_cast<std::size_t>(slot)]; }

  ServerLink& link_;
  SupervisorOptions options_;
  spdlog::logger& logger_;
  Pool pool_;
  PoolCalls calls_;
  std::vector<Child> children_;
  std::optional<ExitCode> exit_code_;
};

}  // namespace legopt::worker
