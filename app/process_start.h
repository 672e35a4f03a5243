#pragma once

#include <cstddef>
#include <filesystem>

/// Normalises the process state inherited from shells, batch systems and services, for all programs. Linux.
namespace legopt::app {

/// Type of a process, which decides how it handles signals.
enum class ProcessKind {
  kCommand,  ///< command of a shell: ended by SIGPIPE when its reader has closed
  kService,  ///< runs until a signal stops it
  kJob,      ///< child of a service, which has set the signal mask
};

/// Prepares the process. Must be the first statement of every `main`, before any thread starts:
/// * opens closed descriptors 0 to 2, so that no file or socket gets their numbers; reading and writing them fails as
///   if they were closed;
/// * ignores SIGXFSZ, so that the limit on file sizes causes an ordinary write error (EFBIG); services and jobs also
///   ignore SIGPIPE, SIGUSR1 and SIGUSR2; batch systems use the latter two as warnings;
/// * gives SIGTERM its default action in commands and services, even if the parent ignored it;
/// * gives SIGCHLD its default action and, except for jobs, unblocks all signals, regardless of the parent's settings;
/// * raises the soft limit on open files (RLIMIT_NOFILE) to the hard one;
/// * lowers the soft limit on processor time (RLIMIT_CPU) to a second below the hard one, so that SIGXCPU ends the
///   process; at the hard limit it would be SIGKILL, which hides the cause.
/// Throws std::system_error (EMFILE, ENFILE) if fewer than kFewestDescriptors can be opened.
void PrepareProcess(ProcessKind kind);

/// Number of descriptors that a program needs in addition to those of its job processes and connections.
inline constexpr std::size_t kFewestDescriptors = 40;

/// Returns the number of descriptors that can still be opened, counting up to `most`.
std::size_t FreeDescriptors(std::size_t most);

/// Undoes PrepareProcess in a child that becomes another program: restores the limits and the signal actions (except
/// for SIGINT and SIGTERM, which get their default action). Only makes calls that are safe between fork and exec.
void RestoreStartState();

/// Absolute path of the running program, from the kernel or, without /proc, from the name by which it was started.
/// Empty: unknown.
std::filesystem::path ProgramFile();

}  // namespace legopt::app
