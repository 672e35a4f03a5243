#pragma once

#include <cstdint>

#include "words/words.h"

/// The status numbers of replies and the actions of a control request, as PROTOCOL.md has them: `status` of a message
/// is the number of the enumerator. The words are for people (`legopt tap`).
namespace legopt {

/// hello_reply.status.
enum class HelloStatus : std::int32_t {
  kOk,
  kVersionRefused,  ///< of the protocol
  kDatasetMismatch,
};

template <>
inline constexpr auto kWords<HelloStatus> = Words<HelloStatus>({{HelloStatus::kOk, "ok"},
                                                                {HelloStatus::kVersionRefused, "version_refused"},
                                                                {HelloStatus::kDatasetMismatch, "dataset_mismatch"}});

/// lease_reply.status.
enum class LeaseStatus : std::int32_t {
  kLeased,  ///< with at least one job
  kNoneNow,
  kUnknownWorker,  ///< say hello again
  kDatasetMismatch,
  kNoMoreWork,
};

template <>
inline constexpr auto kWords<LeaseStatus> = Words<LeaseStatus>({{LeaseStatus::kLeased, "leased"},
                                                                {LeaseStatus::kNoneNow, "none_now"},
                                                                {LeaseStatus::kUnknownWorker, "unknown_worker"},
                                                                {LeaseStatus::kDatasetMismatch, "dataset_mismatch"},
                                                                {LeaseStatus::kNoMoreWork, "no_more_work"}});

/// method_reply.status.
enum class MethodStatus : std::int32_t {
  kFound,
  kUnknown,
};

template <>
inline constexpr auto kWords<MethodStatus> = Words<MethodStatus>({{MethodStatus::kFound, "found"},
                                                                  {MethodStatus::kUnknown, "unknown"}});

/// heartbeat_reply.status; 1 is not used.
enum class HeartbeatStatus : std::int32_t {
  kOk,
  kUnused,
  kUnknownWorker,  ///< say hello again
};

template <>
inline constexpr auto kWords<HeartbeatStatus> = Words<HeartbeatStatus>({{HeartbeatStatus::kOk, "ok"},
                                                                        {HeartbeatStatus::kUnused, "unused"},
                                                                        {HeartbeatStatus::kUnknownWorker,
                                                                         "unknown_worker"}});

/// heartbeat_reply.verdicts.
enum class LeaseVerdict : std::int8_t {
  kContinue,
  kCancel,
  kUnknownLease,
};

template <>
inline constexpr auto kWords<LeaseVerdict> = Words<LeaseVerdict>({{LeaseVerdict::kContinue, "continue"},
                                                                  {LeaseVerdict::kCancel, "cancel"},
                                                                  {LeaseVerdict::kUnknownLease, "unknown_lease"}});

/// result_reply.status.
enum class ResultStatus : std::int32_t {
  kAccepted,   ///< and on disk
  kDuplicate,  ///< of an accepted one
  kStale,      ///< kept for audit
  kRefused,
};

template <>
inline constexpr auto kWords<ResultStatus> = Words<ResultStatus>({{ResultStatus::kAccepted, "accepted"},
                                                                  {ResultStatus::kDuplicate, "duplicate"},
                                                                  {ResultStatus::kStale, "stale"},
                                                                  {ResultStatus::kRefused, "refused"}});

/// submit_reply.status.
enum class SubmitStatus : std::int32_t {
  kCreated,
  kAlreadyKnown,
  kRefused,
};

template <>
inline constexpr auto kWords<SubmitStatus> = Words<SubmitStatus>({{SubmitStatus::kCreated, "created"},
                                                                  {SubmitStatus::kAlreadyKnown, "already_known"},
                                                                  {SubmitStatus::kRefused, "refused"}});

/// query_reply.status.
enum class QueryStatus : std::int32_t {
  kOk,
  kRefused,  ///< or failed
  kStopped,  ///< at its time limit
};

template <>
inline constexpr auto kWords<QueryStatus> = Words<QueryStatus>({{QueryStatus::kOk, "ok"},
                                                                {QueryStatus::kRefused, "refused"},
                                                                {QueryStatus::kStopped, "stopped"}});

/// control_reply.status and cancel_reply.status.
enum class ControlStatus : std::int32_t {
  kOk,  ///< done, or so already
  kUnknownExperiment,
  kRefused,
};

template <>
inline constexpr auto kWords<ControlStatus> = Words<ControlStatus>({{ControlStatus::kOk, "ok"},
                                                                    {ControlStatus::kUnknownExperiment,
                                                                     "unknown_experiment"},
                                                                    {ControlStatus::kRefused, "refused"}});

/// shutdown_reply.status.
enum class ShutdownStatus : std::int32_t {
  kStopping,
  kRefused,
};

template <>
inline constexpr auto kWords<ShutdownStatus> = Words<ShutdownStatus>({{ShutdownStatus::kStopping, "stopping"},
                                                                      {ShutdownStatus::kRefused, "refused"}});

/// control_request.action.
enum class ControlAction : std::int8_t {
  kPause,
  kResume,
  kHold,  ///< with a reason
  kRelease,
  kPriority,
  kRetry,
  kRetryTimeLimits,  ///< also the jobs that the clock stopped
  kRename,
  kTag,
  kUntag,
  kDelete,
  kResumeAnyBuild,  ///< resume, and let workers of any build finish it
};

template <>
inline constexpr auto kWords<ControlAction> =
    Words<ControlAction>({{ControlAction::kPause, "pause"},
                          {ControlAction::kResume, "resume"},
                          {ControlAction::kHold, "hold"},
                          {ControlAction::kRelease, "release"},
                          {ControlAction::kPriority, "priority"},
                          {ControlAction::kRetry, "retry"},
                          {ControlAction::kRetryTimeLimits, "retry_time_limits"},
                          {ControlAction::kRename, "rename"},
                          {ControlAction::kTag, "tag"},
                          {ControlAction::kUntag, "untag"},
                          {ControlAction::kDelete, "delete"},
                          {ControlAction::kResumeAnyBuild, "resume_any_build"}});

}  // namespace legopt
