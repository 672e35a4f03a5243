#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/processes.h"

namespace legopt::external {

/// Command that the launcher may start.
struct LaunchCommand {
  std::filesystem::path executable;         ///< absolute
  std::vector<std::string> arguments;       ///< argv, including its first word
  std::filesystem::path folder;             ///< working directory
  std::vector<std::string> variables = {};  ///< names of variables passed on in addition to the usual ones
  bool needs_network = false;               ///< the process stays in the network namespace of the worker
};

/// Resources used by processes.
struct ProcessUsage {
  std::int64_t cpu_us = 0;             ///< CPU time, in user and system mode
  std::int64_t peak_memory_bytes = 0;  ///< largest resident size of any process
};

/// End of a solver's process.
struct ProcessEnd {
  int status = 0;       ///< status of waitpid
  bool killed = false;  ///< killed by the launcher
  ProcessUsage usage;   ///< resources of the process and its descendants; CPU time since SolverLauncher::CountFromNow
};

/// Child process that starts external solvers. A job process may not start processes once it runs jobs
/// (worker/job_process.h). The launcher is therefore forked before, without that guard, and starts only the commands
/// declared then. When a solver ends, all its remaining processes end with it, in its process group or in others:
/// orphans become children of the launcher (PR_SET_CHILD_SUBREAPER). When the process that has forked the launcher ends
/// in any way, the launcher ends the solver and itself.
///
/// The launcher hides its memory from the solver, and the solver is confined (solver_confinement.h).
///
/// A solver has its own process group, no core files, files of at most kMaxFileBytes, and one thread in OpenMP and
/// OpenBLAS. One solver at a time; one thread. Linux.
class SolverLauncher {
 public:
  /// Largest file that a solver may write.
  static constexpr std::int64_t kMaxFileBytes = std::int64_t{64} << 20;

  /// Forks the launcher. When it ends, it removes the folder `scratch`, if one is given, however its owner has ended.
  /// Throws std::system_error.
  explicit SolverLauncher(std::span<const LaunchCommand> commands, const std::filesystem::path& scratch = {});
  ~SolverLauncher();
  SolverLauncher(const SolverLauncher&) = delete;
  SolverLauncher& operator=(const SolverLauncher&) = delete;

  /// Ends of a solver's standard streams, non-blocking, and a descriptor that is readable once its process has ended
  /// (pidfd).
  struct Streams {
    app::Descriptor in, out, error, process;
  };

  /// Starts command number `command` with an address space of at most `memory_bytes` (0: no limit). Throws SolverFault
  /// if the system refuses that, and std::system_error if the launcher has ended.
  Streams Start(std::size_t command, std::int64_t memory_bytes);

  /// Starts counting the CPU time of the solver's process, so that its start-up is excluded. Throws std::system_error
  /// if the launcher has ended.
  void CountFromNow();

  /// Ends the solver that was started last with all its processes, and returns once they have ended. `leaving`: it is
  /// about to exit by itself and gets a moment for that. Throws std::system_error if the launcher has ended.
  ProcessEnd End(bool leaving);

  /// Returns the resources used by all solvers that have ended since the last call.
  ProcessUsage TakeUsage() { return std::exchange(usage_, {}); }

 private:
  app::Descriptor socket_;
  pid_t launcher_ = -1;
  ProcessUsage usage_;
};

/// Packet to the launcher.
struct LaunchRequest {
  enum class Kind : std::uint8_t { kStart, kCount, kEnd } kind = Kind::kStart;
  bool leaving = false;           ///< kEnd: the solver is about to exit by itself
  std::uint32_t command = 0;      ///< kStart: index of the command
  std::int64_t memory_bytes = 0;  ///< kStart: memory limit
};

/// Answer of the launcher. If a solver was started, four descriptors come with it: its three streams and its pidfd.
struct LaunchReply {
  int error = 0;   ///< errno of kStart
  ProcessEnd end;  ///< result of kEnd
};

/// Main function of the launcher after the fork, as a child of `owner`. Returns its exit status.
int ServeLaunches(int socket, std::span<const LaunchCommand> commands);

}  // namespace legopt::external
