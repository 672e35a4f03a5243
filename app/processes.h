#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace legopt::app {

/// Returns the name and meaning of a signal that ended a process: "SIGKILL (killed from outside, perhaps because the
/// machine ran out of memory)", "SIGRTMIN+3 (real-time signal)". Thread-safe.
std::string SignalMeaning(int signal);

/// An exit code: "exit code 3", and for 128 + N, with which shells and wrapper scripts report that signal N ended their
/// program, also the signal's meaning. Thread-safe.
std::string ExitCodeMeaning(int code);

/// Utilities for starting processes: the programs that a client runs, the job processes of a worker, isolated calls,
/// the pager. Callers decide how each is started and what it inherits. Thread-safe. Linux.

/// File descriptor, closed by the destructor unless taken.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  ~Descriptor() { Close(); }
  Descriptor(Descriptor&& other) noexcept : fd_(other.Take()) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    Close();
    fd_ = other.Take();
    return *this;
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  int get() const { return fd_; }  ///< -1: none
  bool open() const { return fd_ >= 0; }
  int Take() { return std::exchange(fd_, -1); }
  void Close();
  /// Makes reads and writes return immediately.
  void SetNonBlocking() const;

 private:
  int fd_;
};

struct Pipe {
  Descriptor read, write;
};

/// Returns whether a file is a regular file that this process may execute.
bool IsExecutable(const std::filesystem::path& file);

/// Returns " without /dev/null (...)" if /dev/null, which programs get as their standard input, cannot be opened; else
/// an empty text. To be added to "cannot start PROGRAM": the error alone looks like that of a missing program.
std::string MissingNullDevice();

/// Returns the program that a shell would run for a name without a slash: the first one in PATH, absolute; empty if
/// there is none.
std::filesystem::path FindProgram(const std::string& name);

/// Creates a pipe whose ends are closed on exec; empty, with errno set, if the system refuses.
std::optional<Pipe> MakePipe();

/// Returns pointers to the texts and a final null, as required by exec. `texts` must outlive their use.
std::vector<char*> Pointers(std::vector<std::string>& texts);

/// Called in a child immediately after its start: `signal` is sent to it when `parent` dies. Returns false if the
/// parent has already died. Only makes calls that are safe between fork and exec.
bool DieWith(pid_t parent, int signal);

/// Unblocks all signals. Only makes calls that are safe between fork and exec.
void UnblockSignals();

/// Waits for the end of a child and returns its status; empty if it is not a child (any more).
std::optional<int> WaitForEnd(pid_t child);

/// Normalises the process state inherited from shells, batch systems and services, for all programs. Linux.

/// Type of a process, which decides how it handles signals.
enum class ProcessKind {
  kCommand,  ///< command of a shell: RunProgram ends it as SIGPIPE does when the reader of its output has closed
  kService,  ///< runs until a signal stops it
  kJob,      ///< child of a service, which has set the signal mask
};

/// Prepares the process. Must be the first statement of every `main`, before any thread starts:
/// * opens closed descriptors 0 to 2, so that no file or socket gets their numbers; reading and writing them fails as
///   if they were closed;
/// * ignores SIGXFSZ, so that the limit on file sizes causes an ordinary write error (EFBIG);
/// * in commands and services, ignores SIGPIPE, so that a closed pipe is a write error (EPIPE); in services, also
///   SIGUSR1 and SIGUSR2, which batch systems use as warnings;
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
