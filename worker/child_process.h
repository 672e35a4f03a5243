#pragma once

#include <sys/types.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "legopt_msg/capability.hpp"
#include "worker/job_executor.h"
#include "worker/job_slot.h"

namespace legopt::worker {

/// Messages between supervisor and job process over their socket pair.
///
/// A frame is a header of 32 bytes, native byte order (both ends are the same program on one host), and a body:
///
///     offset  0  uint32  magic 0x4c474a31
///     offset  4  uint32  type (FrameType)
///     offset  8  uint64  sequence number of the job concerned; 0 when none
///     offset 16  uint64  length of the body, bytes
///     offset 24  uint64  SipHash-2-4 of bytes 4 - 23 and the body, under a fixed key
///
/// The supervisor does not trust the job process: anything but a well-formed frame at the right time ends the process.
enum class FrameType : std::uint32_t {
  kJob = 1,          ///< sent to the child: lease and method options (EncodeJob)
  kReady = 2,        ///< datasets and solver declarations are loaded; body: EncodeCapabilities
  kStartFailed = 3,  ///< body: reason why the datasets cannot be used, for the user
  kProgress = 4,     ///< body: done and total, EncodeProgress
  kJudging = 5,      ///< the solver has returned; empty body
  kResult = 6,       ///< body: a result_request with its identification
};

struct Frame {
  FrameType type{};
  std::uint64_t sequence = 0;
  std::string body;
};

inline constexpr std::size_t kFrameHeaderBytes = 32;
/// Largest body in either direction: fits a result of 1e6 numbers and rejects corrupted lengths.
inline constexpr std::size_t kMaxFrameBytes = std::size_t{32} << 20;
inline constexpr std::size_t kReadBytes = 1U << 16;  ///< largest read from the socket

std::string EncodeFrame(const Frame& frame);

/// Splits a byte stream into frames. kGarbage is permanent.
class FrameReader {
 public:
  enum class Status { kNeedMore, kFrame, kGarbage };

  void Append(std::string_view bytes) { buffer_.append(bytes); }
  /// Extracts the next frame. With kGarbage, `why` contains the fault.
  Status Next(Frame* frame, std::string* why);

 private:
  std::string buffer_;
  std::size_t consumed_ = 0;
  bool broken_ = false;
};

// Bodies. Decoders return false for a body that their encoder cannot have written.
std::string EncodeJob(const legopt_msg::lease& lease, std::string_view options_json);
bool DecodeJob(std::string_view body, legopt_msg::lease* lease, std::string* options_json);
std::string EncodeCapabilities(const std::vector<Capability>& capabilities);
bool DecodeCapabilities(std::string_view body, std::vector<Capability>* capabilities);
/// Returns the form used in a hello.
legopt_msg::capability ToMessage(const Capability& capability);
std::string EncodeProgress(int done, int total);
bool DecodeProgress(std::string_view body, int* done, int* total);

/// Supervisor's side of one job process: start, communication, end. All descriptors are non-blocking and close-on-exec.
/// The destructor kills the process and waits for its end. One thread.
///
/// The process is created by posix_spawn (never by fork alone: the supervisor has LCM's threads) in its own process
/// group. It inherits only the socket (descriptor kSocket), /dev/null as input, a pipe as output and error, and a
/// signal mask that blocks signals for the supervisor (job_process.h).
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
