#pragma once

#include "bus/field.h"
#include "bus/message_limits.h"
#include "bus/messages.h"
#include "legopt/types/reply.h"

namespace legopt::bus::fields {

/// @file
/// Fields of the clients' calls: submit, store_dataset, status, query, cancel and control. PROTOCOL.md, section 9.

inline constexpr std::int64_t kIdBytes = 128;                         ///< length of a submission id
inline constexpr std::int64_t kAnswerBytes = std::int64_t{48} << 20;  ///< size of the rows of a query
inline constexpr std::int64_t kMostRows = 1'000'000;                  ///< rows of a query
inline constexpr std::int64_t kMostPriority = 1000;                   ///< largest absolute value
inline constexpr std::int64_t kReasonBytes = 1000;                    ///< length of the reason for a hold

template <>
struct Description<legopt_msg::submit_request> {
  using M = legopt_msg::submit_request;
  static constexpr std::tuple kRows{Field{"submission_id", &M::submission_id, Text{1, kIdBytes}},
                                    Field{"spec_json", &M::spec_json, Json{1, kJsonBytes}}};
};

template <>
struct Description<legopt_msg::submit_reply> {
  using M = legopt_msg::submit_reply;
  static constexpr std::tuple kRows{
      Field{"status", &M::status, ValueOf<SubmitStatus>{}},
      Field{"experiment_id", &M::experiment_id, AtLeast{If{&M::status, SubmitStatus::kRefused, 0, 1}}},
      Field{"num_jobs", &M::num_jobs, AtLeast{0}}, Field{"message", &M::message, ForHumans(kTextBytes)}};
};

template <>
struct Description<legopt_msg::store_dataset_request> {
  using M = legopt_msg::store_dataset_request;
  static constexpr std::tuple kRows{Field{"hash", &M::hash, Hash{}},
                                    Field{"num_bytes", &M::num_bytes, CountOf{&M::archive, kMaxStoredArchiveBytes}},
                                    Field{"archive", &M::archive}};
};

template <>
struct Description<legopt_msg::store_dataset_reply> {
  using M = legopt_msg::store_dataset_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<StoreDatasetStatus>{}},
                                    Field{"message", &M::message, ForHumans(kTextBytes)}};
};

template <>
struct Description<legopt_msg::status_request> {
  using M = legopt_msg::status_request;
  static constexpr std::tuple kRows{Field{"experiment_id", &M::experiment_id, AtLeast{0}}};
};

template <>
struct Description<legopt_msg::status_reply> {
  using M = legopt_msg::status_reply;
  static constexpr std::tuple kRows{Field{"json", &M::json, Json{2, kJsonBytes}}};
};

template <>
struct Description<legopt_msg::query_request> {
  using M = legopt_msg::query_request;
  static constexpr std::tuple kRows{Field{"sql", &M::sql, Text{1, kOptionsBytes}},
                                    Field{"max_rows", &M::max_rows, Range{1, kMostRows}}};
};

template <>
struct Description<legopt_msg::query_reply> {
  using M = legopt_msg::query_reply;
  static constexpr std::tuple kRows{
      Field{"status", &M::status, ValueOf<QueryStatus>{}}, Field{"message", &M::message, ForHumans(kTextBytes)},
      Field{"json", &M::json, Json{If{&M::status, QueryStatus::kOk, 2, 0}, kAnswerBytes}}};
};

template <>
struct Description<legopt_msg::cancel_request> {
  using M = legopt_msg::cancel_request;
  static constexpr std::tuple kRows{Field{"experiment_id", &M::experiment_id, AtLeast{1}}};
};

template <>
struct Description<legopt_msg::cancel_reply> {
  using M = legopt_msg::cancel_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<ControlStatus>{}},
                                    Field{"num_jobs", &M::num_jobs, AtLeast{0}},
                                    Field{"message", &M::message, ForHumans(kTextBytes)}};
};

template <>
struct Description<legopt_msg::control_request> {
  using M = legopt_msg::control_request;

  /// Maximum length of a reason, name or tag; 0 if the action takes none. A reason may be empty.
  static constexpr std::int64_t MostReason(const M& m) {
    constexpr std::int64_t kNameOfExperimentBytes = 200;
    constexpr std::int64_t kTagBytes = 100;
    switch (static_cast<ControlAction>(m.action)) {
      case ControlAction::kPause:
      case ControlAction::kPauseNow:
        return kReasonBytes;
      case ControlAction::kRename:
        return kNameOfExperimentBytes;
      case ControlAction::kTag:
      case ControlAction::kUntag:
        return kTagBytes;
      default:
        return 0;
    }
  }
  static constexpr std::int64_t LeastReason(const M& m) {
    const auto action = static_cast<ControlAction>(m.action);
    const bool pauses = action == ControlAction::kPause || action == ControlAction::kPauseNow;
    return MostReason(m) > 0 && !pauses ? 1 : 0;
  }

  static constexpr std::tuple kRows{
      Field{"experiment_id", &M::experiment_id, AtLeast{1}}, Field{"action", &M::action, ValueOf<ControlAction>{}},
      Field{"priority", &M::priority,
            Range{If{&M::action, ControlAction::kPriority, -kMostPriority, 0},
                  If{&M::action, ControlAction::kPriority, kMostPriority, 0}}},
      Field{"reason", &M::reason, Cleaned{kReasonBytes, Text{&LeastReason, &MostReason}}}};
};

template <>
struct Description<legopt_msg::control_reply> {
  using M = legopt_msg::control_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<ControlStatus>{}},
                                    Field{"num_jobs", &M::num_jobs, AtLeast{0}},
                                    Field{"message", &M::message, ForHumans(kTextBytes)}};
};

}  // namespace legopt::bus::fields
