#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace legopt::worker {

using std::chrono::microseconds;

/// Exit status with which a job process reports that memory ended.
inline constexpr int kChildOutOfMemory = 81;
/// Exit status of a job process whose supervisor is gone.
inline constexpr int kChildOrphaned = 82;

/// What takes the place of its exit status when a job process could not even be started.
inline constexpr int kChildNotStarted = 127;

/// How a job process ended.
struct ChildExit {
  int signal = 0;        ///< that killed it; 0: it exited by itself
  int exit_code = 0;     ///< when signal is 0
  std::string log_tail;  ///< last lines it wrote to standard error, bounded
  std::int64_t peak_memory_bytes = 0;
};

/// Why a job was stopped before it had finished.
enum class StopReason {
  kNone,
  kTimeLimit,      ///< hard wall-time limit of the job
  kCancelled,      ///< the server said so
  kUnknownLease,   ///< the server does not know the lease (any more)
  kLeaseExpiring,  ///< not renewed; the server may soon give the job to somebody else
  kGarbage,        ///< the process broke the protocol
  kShutdown,       ///< the worker is told to stop at once
  kWaited,         ///< it had no slot for too long, another worker may have one
};

/// Times that a slot keeps to.
struct SlotTimes {
  microseconds start_limit = std::chrono::seconds(120);         ///< loading datasets
  microseconds kill_grace = std::chrono::seconds(1);            ///< beyond the wall limit of a job (solving)
  microseconds judge_limit = std::chrono::seconds(120);         ///< judging one solution
  microseconds cancel_grace = std::chrono::milliseconds(500);   ///< between asking a job to stop and killing it
  microseconds first_restart = std::chrono::milliseconds(250);  ///< after a failed start; doubles
  microseconds last_restart = std::chrono::seconds(30);
};

/// One slot of a worker: the life of its job process and of the job on it, as a pure state machine. It does nothing by
/// itself: each event returns the command to carry out on the process. Time is steady, since an arbitrary start.
///
///     kDown --start--> kStarting --ready--> kIdle --assign--> kRunning --result--> kIdle
///     kRunning --asked to stop--> kCancelling --result--> kIdle
///     any --kill--> kStopping --exited--> kDown;   any --exited--> kDown
class JobSlot {
 public:
  enum class State { kDown, kStarting, kIdle, kRunning, kCancelling, kStopping };
  enum class Command { kNone, kStart, kCancel, kKill };

  explicit JobSlot(const SlotTimes& times) : times_(times) {}

  State state() const { return state_; }
  /// Whether a job is on this slot: it ends by Finish (true) or by the process's end.
  bool has_job() const { return sequence_ != 0; }
  StopReason stop_reason() const { return reason_; }
  const std::string& stop_detail() const { return detail_; }
  /// Consecutive starts that never became ready.
  int failed_starts() const { return failed_starts_; }
  microseconds assigned_at() const { return assigned_at_; }

  /// When Tick has something to do; microseconds::max() if never.
  microseconds deadline() const { return deadline_; }
  Command Tick(microseconds now);

  /// The process has loaded its datasets. False when that was not expected (treat as garbage).
  bool Ready();
  /// Gives the idle slot a job with this wall limit; returns its sequence number, never 0.
  std::uint64_t Assign(microseconds now, microseconds wall_limit);
  /// The solver of job `sequence` has returned; false when no such job runs (garbage).
  bool Judging(microseconds now, std::uint64_t sequence);
  /// Result of job `sequence` has arrived; the slot is idle again. False when no such job runs (garbage).
  bool Finish(std::uint64_t sequence);
  bool IsCurrent(std::uint64_t sequence) const { return sequence != 0 && sequence == sequence_; }

  /// Stops the job, gently where the reason allows; kNone when there is none or it is being stopped already.
  Command StopJob(microseconds now, StopReason reason);
  /// The process broke the protocol, in whatever state.
  Command Kill(StopReason reason, std::string detail);
  /// The process is gone. The caller has taken note of job, reason and detail before.
  void Exited(microseconds now);
  /// No restart any more.
  void Retire() { retired_ = true; }

 private:
  void SetState(State state, microseconds deadline);

  SlotTimes times_;
  State state_ = State::kDown;
  microseconds deadline_{0};  // kDown: start at once
  bool retired_ = false;
  int failed_starts_ = 0;
  std::uint64_t sequence_ = 0;  // of the current job
  std::uint64_t last_sequence_ = 0;
  microseconds assigned_at_{0};
  StopReason reason_ = StopReason::kNone;
  std::string detail_;
};

}  // namespace legopt::worker
