#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "programs/processes.h"

namespace legopt::external {

/// What is started.
struct LaunchCommand {
  std::filesystem::path executable;         ///< absolute
  std::vector<std::string> arguments;       ///< argv, its first word included
  std::filesystem::path folder;             ///< where it runs
  std::vector<std::string> variables = {};  ///< names of variables passed on beside the usual ones
  bool needs_network = false;               ///< it is left in the network namespace of the worker
};

/// What processes have used.
struct ProcessUsage {
  std::int64_t cpu_us = 0;             ///< CPU time, in user and system mode
  std::int64_t peak_memory_bytes = 0;  ///< largest resident size of any
};

/// How a solver's process ended.
struct ProcessEnd {
  int status = 0;       ///< as of waitpid
  bool killed = false;  ///< by us: it did not end by itself
  ProcessUsage usage;   ///< of it and all that it has left behind; CPU time since SolverLauncher::CountFromNow
};

/// A process beside this one that starts solvers for it. A job process may start none once it runs jobs
/// (worker/process_guards.h); hence this one, which is forked before and stays without that guard, starts what was
/// declared then and nothing else. Whatever a solver leaves behind, in its process group or in others, ends with it:
/// orphans become children of the launcher (PR_SET_CHILD_SUBREAPER). When the process that has forked it ends, in
/// whatever way, the launcher ends the solver and itself.
///
/// The launcher hides its memory from the solver, and the solver is confined (solver_confinement.h).
///
/// A solver has its own process group, no core files, files of at most kMaxFileBytes, and one thread in OpenMP and
/// OpenBLAS. One solver at a time; one thread. Linux.
class SolverLauncher {
 public:
  /// Largest file that a solver may write.
  static constexpr std::int64_t kMaxFileBytes = std::int64_t{64} << 20;

  /// Forks. `scratch`, if it names a folder, is removed when the launcher ends, whatever has become of its owner.
  /// Throws std::system_error.
  explicit SolverLauncher(std::span<const LaunchCommand> commands, const std::filesystem::path& scratch = {});
  ~SolverLauncher();
  SolverLauncher(const SolverLauncher&) = delete;
  SolverLauncher& operator=(const SolverLauncher&) = delete;

  /// Ends of a solver's standard streams, not blocking, and what is readable once its process has ended (pidfd).
  struct Streams {
    programs::Descriptor in, out, error, process;
  };

  /// Starts command number `command` with an address space of at most `memory_bytes` (0: no limit). Throws SolverFault
  /// when the system refuses that, and std::system_error when the launcher is gone.
  Streams Start(std::size_t command, std::int64_t memory_bytes);

  /// CPU time of the solver's process counts from now on: what it has taken to start does not. Throws std::system_error
  /// when the launcher is gone.
  void CountFromNow();

  /// Ends the solver that was started last with all of its processes, and returns once they are gone. `leaving`: it is
  /// about to end by itself, and gets a moment for that. Throws std::system_error when the launcher is gone.
  ProcessEnd End(bool leaving);

  /// Of all solvers that have ended since the last call.
  ProcessUsage TakeUsage() { return std::exchange(usage_, {}); }

 private:
  programs::Descriptor socket_;
  pid_t launcher_ = -1;
  ProcessUsage usage_;
};

}  // namespace legopt::external
