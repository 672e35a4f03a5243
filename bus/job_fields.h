#pragma once

#include "bus/field.h"
#include "bus/field_limits.h"
#include "bus/field_rules.h"
#include "bus/messages.h"
#include "legopt/types/reply.h"
#include "legopt/types/task.h"

/// @file
/// Fields of the calls by which workers receive and keep jobs: lease, method, dataset and heartbeat. PROTOCOL.md,
/// section 9.

namespace legopt::bus::fields {

inline constexpr std::int64_t kMaxJobs = 1024;                                ///< jobs in one lease reply
inline constexpr std::int64_t kLongestWall_us = 365 * (86'400 * kSecond_us);  ///< a year
inline constexpr std::int64_t kLongestRetry_us = 3'600 * kSecond_us;          ///< an hour

template <>
struct Description<legopt_msg::lease_request> {
  using M = legopt_msg::lease_request;
  static constexpr std::tuple kRows{
      Field{"worker_id", &M::worker_id, AtLeast{1}}, Field{"server_instance", &M::server_instance, AtLeast{1}},
      Field{"slot", &M::slot, Range{0, kMostSlots - 1}}, Field{"max_jobs", &M::max_jobs, Range{1, kMaxJobs}}};
};

template <>
struct Description<legopt_msg::lease> {
  using M = legopt_msg::lease;
  static constexpr std::tuple kRows{Field{"job_id", &M::job_id, AtLeast{1}},
                                    Field{"experiment_id", &M::experiment_id, AtLeast{1}},
                                    Field{"attempt", &M::attempt, AtLeast{1}},
                                    Field{"token", &M::token, NonZero{}},
                                    Field{"lease_us", &M::lease_us, Range{1, kLongestLease_us}},
                                    Field{"dataset_hash", &M::dataset_hash, Hash{}},
                                    Field{"method_hash", &M::method_hash, Hash{}},
                                    Field{"task", &M::task, EnumNameOf<Task>{}},
                                    Field{"initialization", &M::initialization, EnumNameOf<Initialization>{}},
                                    Field{"problem_id", &M::problem_id, AtLeast{0}},
                                    Field{"repetition", &M::repetition, AtLeast{0}},
                                    Field{"experiment_seed", &M::experiment_seed},
                                    Field{"effort_limit", &M::effort_limit, AtLeast{0}},
                                    Field{"wall_limit_us", &M::wall_limit_us, Range{1, kLongestWall_us}},
                                    Field{"memory_limit_bytes", &M::memory_limit_bytes, AtLeast{0}}};
};

template <>
struct Description<legopt_msg::lease_reply> {
  using M = legopt_msg::lease_reply;

  static void JobsComeWithLeased(const M& m, FieldCheck& check) {
    check.Require((m.status == static_cast<std::int32_t>(LeaseStatus::kLeased)) == (m.num_jobs > 0),
                  "num_jobs: jobs come with status 0 and with no other");
  }
  static void DatasetIsWantedWithoutJobs(const M& m, FieldCheck& check) {
    if (m.wanted_dataset.empty()) return;
    check.Hash("wanted_dataset", m.wanted_dataset);
    check.Require(m.status == static_cast<std::int32_t>(LeaseStatus::kNoneNow),
                  "wanted_dataset: a hash comes with status 1 and with no other");
  }

  static constexpr std::tuple kRows{
      Field{"status", &M::status, ValueOf<LeaseStatus>{}},
      Field{"retry_after_us", &M::retry_after_us, Range{0, kLongestRetry_us}},
      Field{"message", &M::message, ForHumans(kTextBytes)},
      Field{"num_jobs", &M::num_jobs, CountOf{&M::jobs, kMaxJobs}, &JobsComeWithLeased},
      Field{"jobs", &M::jobs},
      Field{"wanted_dataset", &M::wanted_dataset, Text{0, kEnumNameBytes}, &DatasetIsWantedWithoutJobs}};
};

template <>
struct Description<legopt_msg::method_request> {
  using M = legopt_msg::method_request;
  static constexpr std::tuple kRows{Field{"hash", &M::hash, Hash{}}};
};

template <>
struct Description<legopt_msg::method_reply> {
  using M = legopt_msg::method_reply;
  static constexpr std::tuple kRows{
      Field{"status", &M::status, ValueOf<MethodStatus>{}},
      Field{"options_json", &M::options_json, Json{If{&M::status, MethodStatus::kFound, 2, 0}, kOptionsBytes}}};
};

template <>
struct Description<legopt_msg::dataset_request> {
  using M = legopt_msg::dataset_request;
  static constexpr std::tuple kRows{Field{"hash", &M::hash, Hash{}},
                                    Field{"offset", &M::offset, Range{0, kMaxArchiveBytes}}};
};

template <>
struct Description<legopt_msg::dataset_reply> {
  using M = legopt_msg::dataset_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<DatasetStatus>{}},
                                    Field{"archive_bytes", &M::archive_bytes, Range{0, kMaxArchiveBytes}},
                                    Field{"num_bytes", &M::num_bytes, CountOf{&M::piece, kMaxPieceBytes}},
                                    Field{"piece", &M::piece}};
};

template <>
struct Description<legopt_msg::lease_state> {
  using M = legopt_msg::lease_state;

  static void ProgressIsWithin(const M& m, FieldCheck& check) {
    check.Range("progress_done", m.progress_done, 0, m.progress_total);
  }

  static constexpr std::tuple kRows{Field{"job_id", &M::job_id, AtLeast{1}}, Field{"attempt", &M::attempt, AtLeast{1}},
                                    Field{"token", &M::token, NonZero{}}, Field{"progress_done", &M::progress_done},
                                    Field{"progress_total", &M::progress_total, AtLeast{0}, &ProgressIsWithin}};
};

template <>
struct Description<legopt_msg::heartbeat_request> {
  using M = legopt_msg::heartbeat_request;
  static constexpr std::tuple kRows{Field{"worker_id", &M::worker_id, AtLeast{1}},
                                    Field{"server_instance", &M::server_instance, AtLeast{1}},
                                    Field{"load", &M::load, NanOrFinite{}, &LoadIsPossible<M>},
                                    Field{"leaving", &M::leaving, Range{0, 1}},
                                    Field{"num_leases", &M::num_leases, CountOf{&M::leases, kMostLeases}},
                                    Field{"leases", &M::leases}};
};

template <>
struct Description<legopt_msg::heartbeat_reply> {
  using M = legopt_msg::heartbeat_reply;
  static constexpr std::tuple kRows{Field{"server_instance", &M::server_instance, AtLeast{1}},
                                    Field{"status", &M::status, ValueOf<HeartbeatStatus>{}},
                                    Field{"num_leases", &M::num_leases, CountOf{&M::verdicts, kMostLeases}},
                                    Field{"verdicts", &M::verdicts, Each{ValueOf<LeaseVerdict>{}}}};
};

}  // namespace legopt::bus::fields
