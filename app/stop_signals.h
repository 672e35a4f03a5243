#pragma once

#include <sys/types.h>

#include <vector>

namespace legopt::app {

/// Signals that stop this process: SIGTERM always; SIGINT and SIGHUP unless they were ignored when the process was
/// started (background jobs of scripts, nohup): then they stay ignored. Clients and services all use this function.
std::vector<int> StoppingSignals();

/// Orders to stop for a program that waits in one place: StoppingSignals() as a descriptor. Create it before any
/// thread: later threads inherit the blocked signals. Signals that do not mean "stop" must not end the program:
/// SIGPIPE, and SIGUSR1 and SIGUSR2, by which batch systems warn every process of a job, are ignored from then on. The
/// destructor does not restore signals.
///
/// One thread; one object per process.
class StopSignals {
 public:
  /// With `owner` (a process id) only its signals count, and those that the kernel sends when it dies. A program that
  /// belongs to another one waits for that one's order if a batch system signals all of them at once. 0: signals of all
  /// processes count. Throws std::system_error.
  explicit StopSignals(pid_t owner = 0);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Readable when a signal has arrived.
  int descriptor() const { return descriptor_; }
  /// Takes the next order to stop. Returns false if none has arrived.
  bool Take();

 private:
  pid_t owner_;
  int descriptor_ = -1;
};

}  // namespace legopt::app
