#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>
#include <vector>

#include "worker/child_protocol.h"
#include "worker/job_slot.h"

namespace legopt::worker {

/// The supervisor's side of one job process: starting, talking, listening, ending. All descriptors are non-blocking and
/// close-on-exec. The destructor kills the process and waits for its end. One thread.
///
/// The process is made by posix_spawn (never a bare fork: the supervisor has LCM's threads) in a process group of its
/// own, with nothing inherited but the socket (descriptor kSocket), /dev/null as input, a pipe as output and error, and
/// a signal mask that keeps away what is meant for the supervisor (process_guards.h).
class ChildProcess {
 public:
  /// Descriptor of the socket in the child.
  static constexpr int kSocket = 3;

  /// Starts `command` (program, arguments). Throws std::system_error when the system refuses.
  explicit ChildProcess(const std::vector<std::string>& command);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// What to poll: socket (readable; writable while unsent() holds), log pipe (readable), process end (readable).
  /// -1 when closed.
  int socket() const { return socket_; }
  int log_pipe() const { return log_pipe_; }
  int pidfd() const { return pidfd_; }
  pid_t pid() const { return pid_; }

  /// Queues a frame and sends what the socket takes now; false when the process no longer listens.
  bool Send(const Frame& frame);
  bool unsent() const { return !outgoing_.empty(); }
  bool Flush();

  /// Reads what has arrived on the socket, at most about a megabyte; false at its end.
  bool ReadSocket();
  FrameReader::Status NextFrame(Frame* frame, std::string* why) { return reader_.Next(frame, why); }

  /// Reads what the process has logged; returns the new text. Only the last bytes are kept as tail.
  std::string ReadLog();
  /// Forgets the log so far: what follows belongs to another job.
  void ClearLogTail() { log_tail_.clear(); }
  const std::string& log_tail() const { return log_tail_; }

  /// SIGUSR1, which job processes take from their supervisor only.
  void AskToStop();
  /// SIGKILL to the whole process group.
  void Kill();
  /// True once the process has ended; then `exit` describes how, and the rest of the log has been read.
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
