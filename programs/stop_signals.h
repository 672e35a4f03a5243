#pragma once

#include <sys/types.h>

#include <vector>

namespace legopt::programs {

/// The signals that stop this process: SIGTERM always; SIGINT and SIGHUP unless they were ignored when
/// the process was started (background jobs of scripts, nohup), for then they stay ignored. The one place that decides
/// this, for clients and services.
std::vector<int> OrdersToStop();

/// Orders to stop, for a program that waits in one place: OrdersToStop() as a descriptor. Make it before any thread:
/// threads that are made later inherit the blocked signals. Signals that do not mean "stop" must not end the program:
/// SIGUSR1 and SIGUSR2, with which batch systems warn every process of a job, and SIGPIPE are ignored from then on.
/// Signals stay so when the object goes.
///
/// One thread; one object in a process.
class StopSignals {
 public:
  /// With `owner` (a process id) only its signals count, and those that the kernel sends when it dies: a program that
  /// belongs to another one leaves the order of the end to it, when a batch system signals all of them at once. 0:
  /// everybody's count. Throws std::system_error.
  explicit StopSignals(pid_t owner = 0);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  /// Readable when a signal has arrived.
  int descriptor() const { return descriptor_; }
  /// Takes the next order to stop; false when none has arrived.
  bool Take();

 private:
  pid_t owner_;
  int descriptor_ = -1;
};

}  // namespace legopt::programs
