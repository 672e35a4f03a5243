#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// State of a job.
enum class JobState : std::uint8_t {
  kQueued,     ///< waits for a worker
  kLeased,     ///< has one running attempt
  kDone,       ///< has an accepted result, whatever the verdict
  kFailed,     ///< used all attempts; the last one reported that the job cannot run (invalid problem or option)
  kDead,       ///< used all attempts for another reason: crashed, expired, exceeded its time or memory limit
  kCancelled,  ///< cancelled by a user
};

template <>
inline constexpr auto kEnumNames<JobState> = MakeEnumNames<JobState>({{JobState::kQueued, "queued"},
                                                                      {JobState::kLeased, "leased"},
                                                                      {JobState::kDone, "done"},
                                                                      {JobState::kFailed, "failed"},
                                                                      {JobState::kDead, "dead"},
                                                                      {JobState::kCancelled, "cancelled"}});

/// Returns whether a job in this state is finished.
constexpr bool IsTerminal(JobState state) { return state != JobState::kQueued && state != JobState::kLeased; }

/// Outcome of one attempt, as recorded by the server.
enum class AttemptOutcome : std::uint8_t {
  kRunning,      ///< its lease has not ended
  kFinished,     ///< delivered the accepted result
  kCrashed,      ///< the job process died; `exit_signal` has the signal
  kTimeLimit,    ///< stopped at its wall-time limit
  kMemoryLimit,  ///< killed at its memory limit
  kError,        ///< the job process reported that it cannot run this job
  kExpired,      ///< no heartbeat from the worker during the lease
  kCancelled,    ///< the experiment was cancelled
  kReturned,     ///< released unfinished by a running worker (it shut down or never received the lease); not charged
};

template <>
inline constexpr auto kEnumNames<AttemptOutcome> =
    MakeEnumNames<AttemptOutcome>({{AttemptOutcome::kRunning, "running"},
                                   {AttemptOutcome::kFinished, "finished"},
                                   {AttemptOutcome::kCrashed, "crashed"},
                                   {AttemptOutcome::kTimeLimit, "time_limit"},
                                   {AttemptOutcome::kMemoryLimit, "memory_limit"},
                                   {AttemptOutcome::kError, "error"},
                                   {AttemptOutcome::kExpired, "expired"},
                                   {AttemptOutcome::kCancelled, "cancelled"},
                                   {AttemptOutcome::kReturned, "returned"}});

/// Outcome of one attempt, as reported by the worker: the values of result_request.outcome.
enum class ReportedOutcome : std::int8_t {
  kFinished,     ///< ran to its end and was judged, whatever the verdict
  kCrashed,      ///< the job process died or broke the protocol
  kTimeLimit,    ///< the solver stopped at its wall-time limit, or its process was killed after it
  kMemoryLimit,  ///< exceeded the job's memory limit
  kCancelled,    ///< cancelled or released
  kError,        ///< could not be run (no such problem, unknown option)
  kRefused,      ///< this worker lacks a capability that the job requires; not charged
};

template <>
inline constexpr auto kEnumNames<ReportedOutcome> =
    MakeEnumNames<ReportedOutcome>({{ReportedOutcome::kFinished, "finished"},
                                    {ReportedOutcome::kCrashed, "crashed"},
                                    {ReportedOutcome::kTimeLimit, "time_limit"},
                                    {ReportedOutcome::kMemoryLimit, "memory_limit"},
                                    {ReportedOutcome::kCancelled, "cancelled"},
                                    {ReportedOutcome::kError, "error"},
                                    {ReportedOutcome::kRefused, "refused"}});

/// State of an experiment.
enum class ExperimentState : std::uint8_t {
  kActive,    ///< some job is not finished
  kDone,      ///< every job is finished
  kCancelled  ///< cancelled by a user
};

template <>
inline constexpr auto kEnumNames<ExperimentState> =
    MakeEnumNames<ExperimentState>({{ExperimentState::kActive, "active"},
                                    {ExperimentState::kDone, "done"},
                                    {ExperimentState::kCancelled, "cancelled"}});

/// Suspension of an active experiment.
enum class ExperimentHold : std::uint8_t {
  kNone,    ///< jobs are leased
  kPaused,  ///< no job is leased
};

template <>
inline constexpr auto kEnumNames<ExperimentHold> = MakeEnumNames<ExperimentHold>({{ExperimentHold::kNone, "none"},
                                                                                  {ExperimentHold::kPaused, "paused"}});

/// Workers that may run the jobs of an experiment.
enum class BuildPolicy : std::uint8_t {
  kOne,  ///< only workers with the same build as the one that took the first job
  kAny,  ///< all workers
};

template <>
inline constexpr auto kEnumNames<BuildPolicy> = MakeEnumNames<BuildPolicy>({{BuildPolicy::kOne, "one"},
                                                                            {BuildPolicy::kAny, "any"}});

/// Kinds of capabilities that a worker announces by name and hash and that jobs may require.
enum class CapabilityKind : std::uint8_t {
  kDataset,    ///< name and content hash
  kSolver,     ///< external solver: name, and hash of its declaration and files
  kCollision,  ///< collision model (SceneRepresentation): its enum name; no hash
  kFetch,      ///< the worker can fetch missing datasets from the server; no name, no hash
  kUnfetched,  ///< content hash of a dataset that the worker tried to fetch and cannot use
};

template <>
inline constexpr auto kEnumNames<CapabilityKind> =
    MakeEnumNames<CapabilityKind>({{CapabilityKind::kDataset, "dataset"},
                                   {CapabilityKind::kSolver, "solver"},
                                   {CapabilityKind::kCollision, "collision"},
                                   {CapabilityKind::kFetch, "fetch"},
                                   {CapabilityKind::kUnfetched, "unfetched"}});

/// Result of re-running a job, compared with its stored result.
enum class Reproduction : std::uint8_t {
  kBitIdentical,  ///< same solution, counts, costs and verdicts, bit by bit
  kSameStatus,    ///< same status and verdicts, but different bits
  kDiffers,       ///< another status or verdict, or no result
};

template <>
inline constexpr auto kEnumNames<Reproduction> =
    MakeEnumNames<Reproduction>({{Reproduction::kBitIdentical, "bit-identical"},
                                 {Reproduction::kSameStatus, "same status"},
                                 {Reproduction::kDiffers, "differs"}});

}  // namespace legopt
