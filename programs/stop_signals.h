#pragma once

#include <sys/types.h>

namespace legopt::programs {

/// Orders to stop, for a program that waits in one place: SIGINT, SIGTERM and SIGHUP as a descriptor. Make it before
/// any thread: those made later have the signals blocked, too. What does not mean "stop" must not end the program:
/// SIGUSR1 and SIGUSR2, with which batch systems warn every process of a job, and SIGPIPE are ignored from then on;
/// SIGHUP is not listened to where it is ignored already (nohup). Signals stay so when the object goes.
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
