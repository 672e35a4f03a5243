#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// Where a job stands.
enum class JobState : std::uint8_t {
  kQueued,     ///< waits for a worker
  kLeased,     ///< one running attempt
  kDone,       ///< has its one accepted result, whatever the verdict
  kFailed,     ///< used up its attempts, the last of which reported that the job cannot run (bad problem or option)
  kDead,       ///< used up its attempts otherwise: crashed, expired, over a limit of time or memory
  kCancelled,  ///< withdrawn by a user
};

template <>
inline constexpr auto kWords<JobState> = Words<JobState>({{JobState::kQueued, "queued"},
                                                          {JobState::kLeased, "leased"},
                                                          {JobState::kDone, "done"},
                                                          {JobState::kFailed, "failed"},
                                                          {JobState::kDead, "dead"},
                                                          {JobState::kCancelled, "cancelled"}});

/// Whether a job in this state is over.
constexpr bool IsTerminal(JobState state) { return state != JobState::kQueued && state != JobState::kLeased; }

/// What became of one attempt, as the server knows it.
enum class AttemptOutcome : std::uint8_t {
  kRunning,      ///< has a lease that has not ended
  kFinished,     ///< gave the accepted result
  kCrashed,      ///< the job process died; `exit_signal` tells how
  kTimeLimit,    ///< stopped by the clock at its wall-time limit
  kMemoryLimit,  ///< killed at its memory limit
  kError,        ///< the job process reported that it cannot run this job
  kExpired,      ///< the worker was not heard of within the lease
  kCancelled,    ///< the experiment was cancelled
  kReturned,     ///< given back unfinished by a living worker (it shut down, or never got the lease); not charged
};

template <>
inline constexpr auto kWords<AttemptOutcome> = Words<AttemptOutcome>({{AttemptOutcome::kRunning, "running"},
                                                                      {AttemptOutcome::kFinished, "finished"},
                                                                      {AttemptOutcome::kCrashed, "crashed"},
                                                                      {AttemptOutcome::kTimeLimit, "time_limit"},
                                                                      {AttemptOutcome::kMemoryLimit, "memory_limit"},
                                                                      {AttemptOutcome::kError, "error"},
                                                                      {AttemptOutcome::kExpired, "expired"},
                                                                      {AttemptOutcome::kCancelled, "cancelled"},
                                                                      {AttemptOutcome::kReturned, "returned"}});

/// What a worker says of one attempt: the values of result_request.outcome.
enum class ReportedOutcome : std::int8_t {
  kFinished,     ///< solved, well or badly, and judged
  kCrashed,      ///< the job process died or broke the protocol
  kTimeLimit,    ///< stopped by the clock: the solver at its wall-time limit, or the process killed behind it
  kMemoryLimit,  ///< needed more memory than the job may have
  kCancelled,    ///< cancelled, or given back
  kError,        ///< could not be run as asked (no such problem, unknown option)
  kRefused,      ///< this worker lacks something that the job needs; not charged
};

template <>
inline constexpr auto kWords<ReportedOutcome> = Words<ReportedOutcome>({{ReportedOutcome::kFinished, "finished"},
                                                                        {ReportedOutcome::kCrashed, "crashed"},
                                                                        {ReportedOutcome::kTimeLimit, "time_limit"},
                                                                        {ReportedOutcome::kMemoryLimit, "memory_limit"},
                                                                        {ReportedOutcome::kCancelled, "cancelled"},
                                                                        {ReportedOutcome::kError, "error"},
                                                                        {ReportedOutcome::kRefused, "refused"}});

/// Where an experiment stands.
enum class ExperimentState : std::uint8_t {
  kActive,    ///< some job is not over
  kDone,      ///< every job is over
  kCancelled  ///< withdrawn by a user
};

template <>
inline constexpr auto kWords<ExperimentState> = Words<ExperimentState>({{ExperimentState::kActive, "active"},
                                                                        {ExperimentState::kDone, "done"},
                                                                        {ExperimentState::kCancelled, "cancelled"}});

/// What keeps an active experiment from being worked on.
enum class Hold : std::uint8_t {
  kNone,    ///< may be worked on
  kPaused,  ///< no job is leased
  kHeld,    ///< the same, and what ran was given back; has a reason
};

template <>
inline constexpr auto kWords<Hold> =
    Words<Hold>({{Hold::kNone, "none"}, {Hold::kPaused, "paused"}, {Hold::kHeld, "held"}});

/// Which workers may finish an experiment.
enum class BuildRule : std::uint8_t {
  kOne,  ///< those of the build that took its first job
  kAny,  ///< all
};

template <>
inline constexpr auto kWords<BuildRule> = Words<BuildRule>({{BuildRule::kOne, "one"}, {BuildRule::kAny, "any"}});

}  // namespace legopt
