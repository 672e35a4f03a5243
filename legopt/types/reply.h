#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

/// @file
/// Status numbers of replies and actions of control requests, as specified in PROTOCOL.md: `status` of a message is the
/// number of the enumerator. The enum names are for display (`legopt service tap`).

namespace legopt {

/// hello_reply.status.
enum class HelloStatus : std::int32_t {
  kOk,               ///< registered
  kVersionRefused,   ///< the protocol version is not supported
  kDatasetMismatch,  ///< the queued jobs need a dataset that the worker has with different content
};

template <>
inline constexpr auto kEnumNames<HelloStatus> =
    MakeEnumNames<HelloStatus>({{HelloStatus::kOk, "ok"},
                                {HelloStatus::kVersionRefused, "version_refused"},
                                {HelloStatus::kDatasetMismatch, "dataset_mismatch"}});

/// lease_reply.status.
enum class LeaseStatus : std::int32_t {
  kLeased,           ///< the reply contains at least one job
  kNoneNow,          ///< nothing to do at present: ask again after the given interval
  kUnknownWorker,    ///< the worker must say hello again
  kDatasetMismatch,  ///< see HelloStatus
  kNoMoreWork,       ///< every experiment is finished, or the server stops
};

template <>
inline constexpr auto kEnumNames<LeaseStatus> =
    MakeEnumNames<LeaseStatus>({{LeaseStatus::kLeased, "leased"},
                                {LeaseStatus::kNoneNow, "none_now"},
                                {LeaseStatus::kUnknownWorker, "unknown_worker"},
                                {LeaseStatus::kDatasetMismatch, "dataset_mismatch"},
                                {LeaseStatus::kNoMoreWork, "no_more_work"}});

/// method_reply.status.
enum class MethodStatus : std::int32_t {
  kFound,    ///< the reply contains the options
  kUnknown,  ///< no experiment has such a method
};

template <>
inline constexpr auto kEnumNames<MethodStatus> = MakeEnumNames<MethodStatus>({{MethodStatus::kFound, "found"},
                                                                              {MethodStatus::kUnknown, "unknown"}});

/// dataset_reply.status.
enum class DatasetStatus : std::int32_t {
  kFound,    ///< the reply contains a piece of the archive
  kUnknown,  ///< the server does not offer this dataset
};

template <>
inline constexpr auto kEnumNames<DatasetStatus> = MakeEnumNames<DatasetStatus>({{DatasetStatus::kFound, "found"},
                                                                                {DatasetStatus::kUnknown, "unknown"}});

/// store_dataset_reply.status.
enum class StoreDatasetStatus : std::int32_t {
  kStored,   ///< the archive is on disk
  kWanted,   ///< the archive is missing: send it
  kRefused,  ///< the server does not store the archive; the message has the reason
};

template <>
inline constexpr auto kEnumNames<StoreDatasetStatus> =
    MakeEnumNames<StoreDatasetStatus>({{StoreDatasetStatus::kStored, "stored"},
                                       {StoreDatasetStatus::kWanted, "wanted"},
                                       {StoreDatasetStatus::kRefused, "refused"}});

/// heartbeat_reply.status.
enum class HeartbeatStatus : std::int32_t {
  kOk,             ///< the worker is registered
  kDrain,          ///< finish the running jobs, take no more and leave
  kUnknownWorker,  ///< the worker must say hello again
};

template <>
inline constexpr auto kEnumNames<HeartbeatStatus> = MakeEnumNames<HeartbeatStatus>({{HeartbeatStatus::kOk, "ok"},
                                                                                    {HeartbeatStatus::kDrain, "drain"},
                                                                                    {HeartbeatStatus::kUnknownWorker,
                                                                                     "unknown_worker"}});

/// heartbeat_reply.verdicts.
enum class LeaseVerdict : std::int8_t {
  kContinue,      ///< continue the job
  kCancel,        ///< stop the job: it was cancelled
  kUnknownLease,  ///< stop the job: its lease has expired or was released; a result would be stale
};

template <>
inline constexpr auto kEnumNames<LeaseVerdict> = MakeEnumNames<LeaseVerdict>({{LeaseVerdict::kContinue, "continue"},
                                                                              {LeaseVerdict::kCancel, "cancel"},
                                                                              {LeaseVerdict::kUnknownLease,
                                                                               "unknown_lease"}});

/// result_reply.status.
enum class ResultStatus : std::int32_t {
  kAccepted,   ///< stored on disk
  kDuplicate,  ///< repeats an accepted result
  kStale,      ///< kept for audit only
  kRefused,    ///< not a result of this job
};

template <>
inline constexpr auto kEnumNames<ResultStatus> = MakeEnumNames<ResultStatus>({{ResultStatus::kAccepted, "accepted"},
                                                                              {ResultStatus::kDuplicate, "duplicate"},
                                                                              {ResultStatus::kStale, "stale"},
                                                                              {ResultStatus::kRefused, "refused"}});

/// submit_reply.status.
enum class SubmitStatus : std::int32_t {
  kCreated,       ///< a new experiment
  kAlreadyKnown,  ///< this submission id already created an experiment
  kRefused,       ///< invalid specification, or the id belongs to another one; the message has the reason
};

template <>
inline constexpr auto kEnumNames<SubmitStatus> = MakeEnumNames<SubmitStatus>({{SubmitStatus::kCreated, "created"},
                                                                              {SubmitStatus::kAlreadyKnown,
                                                                               "already_known"},
                                                                              {SubmitStatus::kRefused, "refused"}});

/// query_reply.status.
enum class QueryStatus : std::int32_t {
  kOk,       ///< the reply contains the rows
  kRefused,  ///< the query is not permitted or failed
  kStopped,  ///< stopped at its time limit
};

template <>
inline constexpr auto kEnumNames<QueryStatus> = MakeEnumNames<QueryStatus>({{QueryStatus::kOk, "ok"},
                                                                            {QueryStatus::kRefused, "refused"},
                                                                            {QueryStatus::kStopped, "stopped"}});

/// control_reply.status and cancel_reply.status.
enum class ControlStatus : std::int32_t {
  kOk,                 ///< done now or before
  kUnknownExperiment,  ///< no such experiment
  kRefused,            ///< not possible in the experiment's present state; the message has the reason
};

template <>
inline constexpr auto kEnumNames<ControlStatus> = MakeEnumNames<ControlStatus>({{ControlStatus::kOk, "ok"},
                                                                                {ControlStatus::kUnknownExperiment,
                                                                                 "unknown_experiment"},
                                                                                {ControlStatus::kRefused, "refused"}});

/// shutdown_reply.status.
enum class ShutdownStatus : std::int32_t {
  kStopping,  ///< the server stops
  kRefused,   ///< the sender's key does not permit it
};

template <>
inline constexpr auto kEnumNames<ShutdownStatus> =
    MakeEnumNames<ShutdownStatus>({{ShutdownStatus::kStopping, "stopping"}, {ShutdownStatus::kRefused, "refused"}});

/// control_request.action.
enum class ControlAction : std::int8_t {
  kPause,            ///< lease no more jobs; running jobs finish
  kResume,           ///< lease jobs again
  kPauseNow,         ///< lease no more jobs; re-queue the running jobs without using an attempt
  kRelease,          ///< number of older clients, always refused: kResume ends every pause
  kPriority,         ///< set the priority relative to other experiments
  kRetry,            ///< re-queue failed and dead jobs
  kRetryTimeLimits,  ///< re-queue failed and dead jobs, and those stopped at their wall-time limit
  kRename,           ///< rename the experiment
  kTag,              ///< add a tag
  kUntag,            ///< remove a tag
  kDelete,           ///< delete the experiment with all its results
  kResumeAnyBuild,   ///< resume, and allow workers of any build
  kDrainWorker,      ///< let a worker finish its running jobs and leave
};

template <>
inline constexpr auto kEnumNames<ControlAction> =
    MakeEnumNames<ControlAction>({{ControlAction::kPause, "pause"},
                                  {ControlAction::kResume, "resume"},
                                  {ControlAction::kPauseNow, "pause_now"},
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
