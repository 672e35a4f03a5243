#pragma once

#include <cstddef>
#include <filesystem>

/// The state of the process that shells, batch systems and services hand over, made the same for all programs. Linux.
namespace legopt::programs {

/// Purpose of a process; decides which signals it takes.
enum class ProcessKind {
  kCommand,  ///< a command of a shell: ends by SIGPIPE when its reader has gone
  kService,  ///< runs until a signal stops it
  kJob,      ///< a child of a service, which has set the signal mask
};

/// Prepares the process; the first statement of every `main`, before any thread:
/// * closed descriptors 0 to 2 are opened, so that no file or socket gets their numbers; reading and writing them fails
///   as if they were closed;
/// * SIGXFSZ is ignored, so that a limit on file sizes is an ordinary write error (EFBIG); services and jobs ignore
///   SIGPIPE, SIGUSR1 and SIGUSR2, with which batch systems warn, as well;
/// * SIGTERM ends commands and services although the parent ignored it;
/// * SIGCHLD has its default action and, except for jobs, no signal is blocked, whatever the parent left;
/// * the soft limit on open files (RLIMIT_NOFILE) is raised to the hard one;
/// * the soft limit on processor time (RLIMIT_CPU) is a second below the hard one, so that SIGXCPU ends the process: at
///   the hard limit it would be SIGKILL, which does not tell the cause.
/// Throws std::system_error (EMFILE, ENFILE) when fewer than kFewestDescriptors can be opened, whatever the cause.
void PrepareProcess(ProcessKind kind);

/// Number of descriptors that a program needs besides those of its job processes and connections.
inline constexpr std::size_t kFewestDescriptors = 40;

/// Number of descriptors that can still be opened, counted up to `most`.
std::size_t FreeDescriptors(std::size_t most);

/// Undoes PrepareProcess in a child that becomes another program: signals as this program found them, except that
/// SIGINT and SIGTERM have their default action; the former limits. Only makes calls that are safe between
/// fork and exec.
void RestoreStartState();

/// File of the running program, absolute: as the kernel names it, or, without /proc, found by the name that it was
/// started by. Empty: unknown.
std::filesystem::path ProgramFile();

}  // namespace legopt::programs
