#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace legopt::worker {

using std::chrono::microseconds;

/// Exit status of a job process that ran out of memory.
inline constexpr int kChildOutOfMemory = 81;
/// Exit status of a job process whose supervisor is gone.
inline constexpr int kChildOrphaned = 82;

/// Substitute for the exit status of a job process that could not be started.
inline constexpr int kChildNotStarted = 127;

/// Describes the end of a job process.
struct ChildExit {
  int signal = 0;        ///< signal that killed the process; 0: it exited
  int exit_code = 0;     ///< valid if signal is 0
  std::string log_tail;  ///< last lines of its standard error, of limited length
  std::int64_t peak_memory_bytes = 0;
};

/// Reason for stopping a job before it finished.
enum class StopReason {
  kNone,
  kTimeLimit,      ///< hard wall-time limit of the job
  kCancelled,      ///< requested by the server
  kUnknownLease,   ///< the server does not have the lease (any more)
  kLeaseExpiring,  ///< not renewed; the server may soon lease the job again
  kGarbage,        ///< the process broke the protocol
  kShutdown,       ///< the worker must stop immediately
  kWaited,         ///< waited too long for a slot; another worker may have one
};

/// Time limits of a slot.
struct SlotTimes {
  microseconds start_limit = std::chrono::seconds(120);  ///< limit for loading datasets
  microseconds kill_grace = std::chrono::seconds(1);  ///< additional time after the wall-time limit of a job (solving)
  microseconds judge_limit = std::chrono::seconds(120);         ///< limit for judging one solution
  microseconds cancel_grace = std::chrono::milliseconds(500);   ///< time between asking a job to stop and killing it
  microseconds first_restart = std::chrono::milliseconds(250);  ///< delay after a failed start; doubles
  microseconds last_restart = std::chrono::seconds(30);
};

/// State machine of one slot of a worker: its job process and the job on it. Pure: each event returns the command to
/// perform on the process. Time is steady, since an arbitrary start.
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
  /// Whether the slot has a job. A job ends when Finish returns true or when the process ends.
  bool has_job() const { return sequence_ != 0; }
  StopReason stop_reason() const { return reason_; }
  const std::string& stop_detail() const { return detail_; }
  /// Number of consecutive starts that did not become ready.
  int failed_starts() const { return failed_starts_; }
  microseconds assigned_at() const { return assigned_at_; }

  /// Next time for Tick; microseconds::max() if none.
  microseconds deadline() const { return deadline_; }
  Command Tick(microseconds now);

  /// The process has loaded its datasets. Returns false if this was not expected (treat as garbage).
  bool Ready();
  /// Assigns a job with this wall-time limit to the idle slot. Returns its sequence number, which is never 0.
  std::uint64_t Assign(microseconds now, microseconds wall_limit);
  /// The solver of job `sequence` has returned. Returns false if this job is not running (garbage).
  bool Judging(microseconds now, std::uint64_t sequence);
  /// The result of job `sequence` has arrived, and the slot is idle again. Returns false if this job is not running
  /// (garbage).
  bool Finish(std::uint64_t sequence);
  bool IsCurrent(std::uint64_t sequence) const { return sequence != 0 && sequence == sequence_; }

  /// Stops the job, gracefully if the reason permits. Returns kNone if there is no job or it is already being stopped.
  Command StopJob(microseconds now, StopReason reason);
  /// The process violated the protocol, in any state.
  Command Kill(StopReason reason, std::string detail);
  /// The process has ended. The caller must have saved job, reason and detail before.
  void Exited(microseconds now);
  /// Disables further restarts.
  void Retire() { retired_ = true; }

 private:
  void SetState(State state, microseconds deadline);

  SlotTimes times_;
  State state_ = State::kDown;
  microseconds deadline_{0};  // kDown: start immediately
  bool retired_ = false;
  int failed_starts_ = 0;
  std::uint64_t sequence_ = 0;  // current job
  std::uint64_t last_sequence_ = 0;
  microseconds assigned_at_{0};
  StopReason reason_ = StopReason::kNone;
  std::string detail_;
};

}  // namespace legopt::worker
