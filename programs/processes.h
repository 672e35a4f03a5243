#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// What all who start processes need of the system: the programs a client runs, the job processes of a worker, isolated
/// calls, the pager. How each is started, and what it inherits, is theirs. Thread-safe. Linux.
namespace legopt::programs {

/// One descriptor, closed at the end unless taken.
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
  /// Reads and writes return at once.
  void SetNonBlocking() const;

 private:
  int fd_;
};

struct Pipe {
  Descriptor read, write;
};

/// A regular file that this process may run.
bool IsExecutable(const std::filesystem::path& file);

/// The program that a shell would run for a name without a slash: the first of PATH, absolute; empty when there is
/// none.
std::filesystem::path FindProgram(const std::string& name);

/// A pipe whose ends are closed on exec; empty, with errno, where the system refuses.
std::optional<Pipe> MakePipe();

/// Pointers to the texts and a null behind them, as exec takes them. `texts` must outlive their use.
std::vector<char*> Pointers(std::vector<std::string>& texts);

/// In a child, right after its start: `signal` is sent to it when `parent` dies. False: that has happened already. Only
/// makes calls that are safe between fork and exec.
bool DieWith(pid_t parent, int signal);

/// Lets every signal through. Only makes calls that are safe between fork and exec.
void UnblockSignals();

/// Waits for the end of a child and returns its status; empty where it is none (any more).
std::optional<int> WaitForEnd(pid_t child);

}  // namespace legopt::programs
