#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Utilities for starting processes: the programs that a client runs, the job processes of a worker, isolated calls,
/// the pager. Callers decide how each is started and what it inherits. Thread-safe. Linux.
namespace legopt::app {

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

}  // namespace legopt::app
