#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <vector>

#include "worker/child_protocol.h"
#include "worker/job_slot.h"

namespace legopt::worker {

/// Supervisor's side of one job process: start, communication, end. All descriptors are non-blocking and close-on-exec.
/// The destructor kills the process and waits for its end. One thread.
///
/// The process is created by posix_spawn (never by fork alone: the supervisor has LCM's threads) in its own process
/// group. It inherits only the socket (descriptor kSocket), /dev/null as input, a pipe as output and error, and a
/// signal mask that blocks signals for the supervisor (process_guards.h).
class ChildProcess {
 public:
  /// Descriptor of the socket in the child.
  static constexpr int kSocket = 3;

  /// Starts `command` (program, arguments). Throws std::system_error if the system refuses.
  explicit ChildProcess(const std::vector<std::string>& command);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Descriptors for poll(): socket (readable; writable while unsent() is true), log pipe (readable), end of the
  /// process (readable). -1 if closed.
  int socket() const { return socket_; }
  int log_pipe() const { return log_pipe_; }
  int pidfd() const { return pidfd_; }
  pid_t pid() const { return pid_; }

  /// Queues a frame and sends as much as the socket accepts now. Returns false if the process has closed the socket.
  bool Send(const Frame& frame);
  bool unsent() const { return !outgoing_.empty(); }
  bool Flush();

  /// Reads data from the socket, at most about a megabyte per call. Returns false at its end.
  bool ReadSocket();
  FrameReader::Status NextFrame(Frame* frame, std::string* why) { return reader_.Next(frame, why); }

  /// Reads new output of the process and returns it. Only the last bytes are stored as the tail.
  std::string ReadLog();
  /// Clears the stored log, because following output belongs to another job.
  void ClearLogTail() { log_tail_.clear(); }
  const std::string& log_tail() const { return log_tail_; }

  /// Sends SIGUSR1, which job processes accept only from their supervisor.
  void AskToStop();
  /// Sends SIGKILL to the whole process group.
  void Kill();
  /// Returns true once the process has ended. Then `exit` describes its end, and the rest of the log has been read.
  bool Reap(ChildExit* exit);

 private:
  void CloseDescriptors();

  pid_t pid_ = -1;
  int pidfd_ = -1;
  int socket_ = -1;
  int log_pipe_ = -1;
  std::string outgoing_;
  FrameReader reader_;
  std::string log_tail_;
};

}  // namespace legopt::worker
