#pragma once

#include <cstdint>

#include "words/words.h"

/// @file
/// The status numbers of replies and the actions of a control request, as PROTOCOL.md has them: `status` of a message
/// is the number of the enumerator. The words are for people (`legopt tap`).

namespace legopt {

/// hello_reply.status.
enum class HelloStatus : std::int32_t {
  kOk,               ///< registered
  kVersionRefused,   ///< of the protocol
  kDatasetMismatch,  ///< the jobs that wait need another content of a dataset that the worker has
};

template <>
inline constexpr auto kWords<HelloStatus> = Words<HelloStatus>({{HelloStatus::kOk, "ok"},
                                                                {HelloStatus::kVersionRefused, "version_refused"},
                                                                {HelloStatus::kDatasetMismatch, "dataset_mismatch"}});

/// lease_reply.status.
enum class LeaseStatus : std::int32_t {
  kLeased,           ///< with at least one job
  kNoneNow,          ///< nothing to do at present: ask again after the given time
  kUnknownWorker,    ///< say hello again
  kDatasetMismatch,  ///< as of a hello
  kNoMoreWork,       ///< every experiment is over, or the server stops
};

template <>
inline constexpr auto kWords<LeaseStatus> = Words<LeaseStatus>({{LeaseStatus::kLeased, "leased"},
                                                                {LeaseStatus::kNoneNow, "none_now"},
                                                                {LeaseStatus::kUnknownWorker, "unknown_worker"},
                                                                {LeaseStatus::kDatasetMismatch, "dataset_mismatch"},
                                                                {LeaseStatus::kNoMoreWork, "no_more_work"}});

/// method_reply.status.
enum class MethodStatus : std::int32_t {
  kFound,    ///< with the options
  kUnknown,  ///< no experiment has such a method
};

template <>
inline constexpr auto kWords<MethodStatus> = Words<MethodStatus>({{MethodStatus::kFound, "found"},
                                                                  {MethodStatus::kUnknown, "unknown"}});

/// dataset_reply.status.
enum class DatasetStatus : std::int32_t {
  kFound,    ///< with a piece of it
  kUnknown,  ///< the server does not hand out this one
};

template <>
inline constexpr auto kWords<DatasetStatus> = Words<DatasetStatus>({{DatasetStatus::kFound, "found"},
                                                                    {DatasetStatus::kUnknown, "unknown"}});

/// store_dataset_reply.status.
enum class StoreDatasetStatus : std::int32_t {
  kStored,   ///< the archive is on disk
  kWanted,   ///< the archive is missing: send it
  kRefused,  ///< the server does not store the archive; the message says why
};

template <>
inline constexpr auto kWords<StoreDatasetStatus> = Words<StoreDatasetStatus>({{StoreDatasetStatus::kStored, "stored"},
                                                                              {StoreDatasetStatus::kWanted, "wanted"},
                                                                              {StoreDatasetStatus::kRefused,
                                                                               "refused"}});

/// heartbeat_reply.status.
enum class HeartbeatStatus : std::int32_t {
  kOk,             ///< the worker is registered
  kDrain,          ///< finish what runs, take no more jobs, leave
  kUnknownWorker,  ///< say hello again
};

template <>
inline constexpr auto kWords<HeartbeatStatus> = Words<HeartbeatStatus>({{HeartbeatStatus::kOk, "ok"},
                                                                        {HeartbeatStatus::kDrain, "drain"},
                                                                        {HeartbeatStatus::kUnknownWorker,
                                                                         "unknown_worker"}});

/// heartbeat_reply.verdicts.
enum class LeaseVerdict : std::int8_t {
  kContinue,      ///< go on
  kCancel,        ///< stop the job: it was cancelled
  kUnknownLease,  ///< stop the job: it has expired, or the experiment is held; a result is stale
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
  kRefused,    ///< not a result of this job
};

template <>
inline constexpr auto kWords<ResultStatus> = Words<ResultStatus>({{ResultStatus::kAccepted, "accepted"},
                                                                  {ResultStatus::kDuplicate, "duplicate"},
                                                                  {ResultStatus::kStale, "stale"},
                                                                  {ResultStatus::kRefused, "refused"}});

/// submit_reply.status.
enum class SubmitStatus : std::int32_t {
  kCreated,       ///< a new experiment
  kAlreadyKnown,  ///< the experiment of an earlier submission with this id
  kRefused,       ///< no legal specification, or another one under this id; the message says why
};

template <>
inline constexpr auto kWords<SubmitStatus> = Words<SubmitStatus>({{SubmitStatus::kCreated, "created"},
                                                                  {SubmitStatus::kAlreadyKnown, "already_known"},
                                                                  {SubmitStatus::kRefused, "refused"}});

/// query_reply.status.
enum class QueryStatus : std::int32_t {
  kOk,       ///< with rows
  kRefused,  ///< or failed
  kStopped,  ///< at its time limit
};

template <>
inline constexpr auto kWords<QueryStatus> = Words<QueryStatus>({{QueryStatus::kOk, "ok"},
                                                                {QueryStatus::kRefused, "refused"},
                                                                {QueryStatus::kStopped, "stopped"}});

/// control_reply.status and cancel_reply.status.
enum class ControlStatus : std::int32_t {
  kOk,                 ///< done, or so already
  kUnknownExperiment,  ///< no such experiment
  kRefused,            ///< not possible in its present state; the message says why
};

template <>
inline constexpr auto kWords<ControlStatus> = Words<ControlStatus>({{ControlStatus::kOk, "ok"},
                                                                    {ControlStatus::kUnknownExperiment,
                                                                     "unknown_experiment"},
                                                                    {ControlStatus::kRefused, "refused"}});

/// shutdown_reply.status.
enum class ShutdownStatus : std::int32_t {
  kStopping,  ///< the server stops
  kRefused,   ///< the message's sender may not stop it
};

template <>
inline constexpr auto kWords<ShutdownStatus> = Words<ShutdownStatus>({{ShutdownStatus::kStopping, "stopping"},
                                                                      {ShutdownStatus::kRefused, "refused"}});

/// control_request.action.
enum class ControlAction : std::int8_t {
  kPause,            ///< begin no more jobs
  kResume,           ///< begin jobs again
  kHold,             ///< with a reason
  kRelease,          ///< end of a hold
  kPriority,         ///< before or behind other experiments
  kRetry,            ///< failed and dead jobs once more
  kRetryTimeLimits,  ///< also the jobs that the clock stopped
  kRename,           ///< gives it another name
  kTag,              ///< adds a tag
  kUntag,            ///< takes a tag away
  kDelete,           ///< with all its results
  kResumeAnyBuild,   ///< resume, and let workers of any build finish it
  kDrainWorker,      ///< the worker finishes its running jobs and leaves
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
                          {ControlAction::kResumeAnyBuild, "resume_any_build"},
                          {ControlAction::kDrainWorker, "drain_worker"}});

}  // namespace legopt
