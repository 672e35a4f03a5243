#pragma once

#include <algorithm>
#include <cmath>

#include "bus/field.h"
#include "bus/message_limits.h"
#include "bus/messages.h"
#include "legopt/types/job.h"
#include "legopt/types/reply.h"
#include "legopt/types/task.h"

namespace legopt::bus::fields {

/// @file
/// Fields of the calls that start and end sessions: probe, hello and shutdown.

template <>
struct Description<legopt_msg::probe_request> {
  using M = legopt_msg::probe_request;
  static constexpr std::tuple kRows{Field{"nonce", &M::nonce}};
};

template <>
struct Description<legopt_msg::probe_reply> {
  using M = legopt_msg::probe_reply;
  static constexpr std::tuple kRows{Field{"protocol_version", &M::protocol_version, AtLeast{1}},
                                    Field{"server_version", &M::server_version, Text{0, kNameBytes}},
                                    Field{"hostname", &M::hostname, ForHumans(kNameBytes)},
                                    Field{"pid", &M::pid, AtLeast{1}},
                                    Field{"server_instance", &M::server_instance, AtLeast{1}},
                                    Field{"database", &M::database, ForHumans(kTextBytes)},
                                    Field{"uptime_us", &M::uptime_us, AtLeast{0}},
                                    Field{"wall_clock_us", &M::wall_clock_us, AtLeast{0}}};
};

template <>
struct Description<legopt_msg::capability> {
  using M = legopt_msg::capability;

  static void HashIsEmptyOrWhole(const M& m, FieldCheck& check) {
    if (!m.hash.empty()) check.Hash("hash", m.hash);
  }

  static constexpr std::tuple kRows{Field{"kind", &M::kind, Text{1, kEnumNameBytes}},
                                    Field{"name", &M::name, Text{0, kNameBytes}},
                                    Field{"hash", &M::hash, Text{0, kEnumNameBytes}, &HashIsEmptyOrWhole}};
};

template <>
struct Description<legopt_msg::hello_request> {
  using M = legopt_msg::hello_request;

  static constexpr std::tuple kRows{
      Field{"protocol_version", &M::protocol_version, AtLeast{1}},
      Field{"worker_name", &M::worker_name, Text{1, kNameBytes}},
      Field{"hostname", &M::hostname, ForHumans(kNameBytes)},
      Field{"pid", &M::pid, AtLeast{1}},
      Field{"slots", &M::slots, Range{1, kMostSlots}},
      Field{"build", &M::build, ForHumans(kNameBytes)},
      Field{"build_id", &M::build_id, Text{1, kEnumNameBytes}},
      Field{"processor", &M::processor, ForHumans(kNameBytes)},
      Field{"processors", &M::processors, Range{1, kMaxProcessors}},
      Field{"memory_bytes", &M::memory_bytes, AtLeast{0}},
      Field{"load", &M::load, NanOrFinite{}, &LoadIsPossible<M>},
      Field{"num_capabilities", &M::num_capabilities, CountOf{&M::capabilities, kMaxCapabilities}},
      Field{"capabilities", &M::capabilities}};
};

template <>
struct Description<legopt_msg::hello_reply> {
  using M = legopt_msg::hello_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<HelloStatus>{}},
                                    Field{"server_instance", &M::server_instance, AtLeast{1}},
                                    Field{"worker_id", &M::worker_id, AtLeast{If{&M::status, HelloStatus::kOk, 1, 0}}},
                                    Field{"lease_us", &M::lease_us, Range{0, kLongestLease_us}},
                                    Field{"heartbeat_us", &M::heartbeat_us, Range{0, &M::lease_us}},
                                    Field{"message", &M::message, ForHumans(kTextBytes)}};
};

template <>
struct Description<legopt_msg::shutdown_request> {
  using M = legopt_msg::shutdown_request;
  static constexpr std::tuple kRows{Field{"nonce", &M::nonce}};
};

template <>
struct Description<legopt_msg::shutdown_reply> {
  using M = legopt_msg::shutdown_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<ShutdownStatus>{}}};
};

// Fields of the calls by which workers receive and keep jobs: lease, method, dataset and heartbeat. PROTOCOL.md,
// section 9.

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

// Fields of the call result, which reports the outcome of an attempt. PROTOCOL.md, section 9.

inline constexpr std::int64_t kLogBytes = std::int64_t{64} << 10;      ///< length of the end of a log
inline constexpr std::int64_t kMaxSignals = 64;                        ///< largest number of a signal
inline constexpr std::int64_t kMaxWaypoints = 1'000'000;               ///< waypoints of a solution
inline constexpr std::int64_t kMaxTraceBytes = std::int64_t{1} << 20;  ///< compressed size of a trace
inline constexpr std::int64_t kMaxWaypointNumbers = 4096;              ///< numbers of a waypoint, n + 7

template <>
struct Description<legopt_msg::violation> {
  using M = legopt_msg::violation;

  static void ValueIsPossible(const M& m, FieldCheck& check) { check.Require(!(m.value < 0), "value: is negative"); }

  static constexpr std::tuple kRows{
      Field{"check", &M::check, Text{1, kEnumNameBytes}}, Field{"rule", &M::rule, Text{1, kEnumNameBytes}},
      Field{"waypoint", &M::waypoint, Range{-1, kMaxWaypoints}}, Field{"subject", &M::subject, ForHumans(kTextBytes)},
      Field{"value", &M::value, Finite{}, &ValueIsPossible}};
};

template <>
struct Description<legopt_msg::result_request> {
  using M = legopt_msg::result_request;

  static void InterpolationIsPossible(const M& m, FieldCheck& check) {
    check
        .Require(!(m.interpolation_environment_depth_m < 0 || m.interpolation_self_depth_m < 0),
                 "interpolation: a depth is negative")
        .Require(!(m.margin_relaxed < 0 || m.margin_relaxed > 1), "margin_relaxed: must be within 0 .. 1")
        .Require(!(m.interpolation_free_share < 0 || m.interpolation_free_share > 1),
                 "interpolation_free_share: must be within 0 .. 1");
  }
  static void TimingIsPossible(const M& m, FieldCheck& check) {
    const auto is_share = [](double share) { return !(share < 0 || share > 1); };
    check.Require(!(m.duration_s < 0), "duration_s: must not be negative")
        .Require(!(m.reduced_duration_s < 0), "reduced_duration_s: must not be negative")
        .Require(is_share(m.velocity_limited_share), "velocity_limited_share: must be within 0 .. 1")
        .Require(is_share(m.torque_limited_share), "torque_limited_share: must be within 0 .. 1")
        .Require(is_share(m.contact_limited_share), "contact_limited_share: must be within 0 .. 1");
  }
  static void WaypointsAreWhole(const M& m, FieldCheck& check) {
    check.Require(std::int64_t{m.num_waypoints} * m.waypoint_size == m.num_values,
                  "num_values: must be num_waypoints * waypoint_size");
  }

  static void UnsolvedWaypointsAreWhole(const M& m, FieldCheck& check) {
    const bool whole = m.num_unsolved == 0 ? m.num_unsolved_values == 0 : m.num_unsolved_values % m.num_unsolved == 0;
    check.Require(whole, "num_unsolved_values: must be a multiple of num_unsolved");
  }

  static void Sanitize(M& m) {
    if (std::all_of(m.waypoints.begin(), m.waypoints.end(), [](double value) { return std::isfinite(value); })) return;
    m.waypoints.clear();
    m.num_waypoints = 0;
    m.verdict_detail = CleanText(std::move(m.verdict_detail), kTextBytes - kEnumNameBytes);
    m.verdict_detail += " [waypoints left out: not finite]";
  }

  static constexpr std::tuple kRows{
      Field{"worker_id", &M::worker_id, AtLeast{1}},
      Field{"job_id", &M::job_id, AtLeast{1}},
      Field{"attempt", &M::attempt, AtLeast{1}},
      Field{"token", &M::token, NonZero{}},
      Field{"outcome", &M::outcome, ValueOf<ReportedOutcome>{}},
      Field{"message", &M::message, ForHumans(kTextBytes)},
      Field{"log_tail", &M::log_tail, ForHumans(kLogBytes, Keep::kEnd)},
      Field{"exit_signal", &M::exit_signal, Range{0, kMaxSignals}},
      Field{"solver_status", &M::solver_status, Text{0, kEnumNameBytes}},
      Field{"iterations", &M::iterations, AtLeast{0}},
      Field{"restarts", &M::restarts, AtLeast{0}},
      Field{"starts", &M::starts, AtLeast{0}},
      Field{"term_evaluations", &M::term_evaluations, AtLeast{0}},
      Field{"collision_queries", &M::collision_queries, AtLeast{0}},
      Field{"work_ns", &M::work_ns, AtLeast{0}},
      Field{"margin_relaxed", &M::margin_relaxed, NanOrFinite{}},
      Field{"wall_us", &M::wall_us, AtLeast{0}},
      Field{"cpu_us", &M::cpu_us, AtLeast{0}},
      Field{"involuntary_context_switches", &M::involuntary_context_switches, AtLeast{0}},
      Field{"peak_memory_bytes", &M::peak_memory_bytes, AtLeast{0}},
      Field{"solver_cost", &M::solver_cost, NanOrFinite{}},
      Field{"solver_violation", &M::solver_violation, NanOrFinite{}},
      Field{"verdict_literal", &M::verdict_literal, Text{0, kEnumNameBytes}},
      Field{"verdict_strict", &M::verdict_strict, Text{0, kEnumNameBytes}},
      Field{"verdict_solid", &M::verdict_solid, Text{0, kEnumNameBytes}},
      Field{"verdict_physical", &M::verdict_physical, Text{0, kEnumNameBytes}},
      Field{"verdict_detail", &M::verdict_detail, ForHumans(kTextBytes)},
      Field{"failed_waypoint", &M::failed_waypoint, AtLeast{-1}},
      Field{"cost", &M::cost, NanOrFinite{}},
      Field{"num_violations", &M::num_violations, CountOf{&M::violations, kMaxViolations}},
      Field{"violations", &M::violations},
      Field{"interpolation_environment_depth_m", &M::interpolation_environment_depth_m, NanOrFinite{}},
      Field{"interpolation_self_depth_m", &M::interpolation_self_depth_m, NanOrFinite{}},
      Field{"interpolation_free_share", &M::interpolation_free_share, NanOrFinite{}, &InterpolationIsPossible},
      Field{"holding_postures", &M::holding_postures, AtLeast{0}},
      Field{"holding_without_equilibrium", &M::holding_without_equilibrium, Range{0, &M::holding_postures}},
      Field{"holding_over_torque", &M::holding_over_torque, Range{0, &M::holding_postures}},
      Field{"halfway_postures", &M::halfway_postures, AtLeast{0}},
      Field{"halfway_without_equilibrium", &M::halfway_without_equilibrium, Range{0, &M::halfway_postures}},
      Field{"halfway_over_torque", &M::halfway_over_torque, Range{0, &M::halfway_postures}},
      Field{"duration_s", &M::duration_s, NanOrFinite{}},
      Field{"reduced_duration_s", &M::reduced_duration_s, NanOrFinite{}},
      Field{"velocity_limited_share", &M::velocity_limited_share, NanOrFinite{}},
      Field{"torque_limited_share", &M::torque_limited_share, NanOrFinite{}},
      Field{"contact_limited_share", &M::contact_limited_share, NanOrFinite{}, &TimingIsPossible},
      Field{"windows", &M::windows, AtLeast{0}},
      Field{"windows_solved", &M::windows_solved, Range{0, &M::windows}},
      Field{"num_waypoints", &M::num_waypoints, Range{0, kMaxWaypoints}},
      Field{"waypoint_size", &M::waypoint_size, Range{0, kMaxWaypointNumbers}},
      Field{"num_values", &M::num_values, CountOf{&M::waypoints, INT32_MAX}, &WaypointsAreWhole},
      Field{"waypoints", &M::waypoints, Each{Finite{}}},
      Field{"window_verdict", &M::window_verdict, Text{0, kEnumNameBytes}},
      Field{"first_unsolved", &M::first_unsolved, Range{0, kMaxWaypoints}},
      Field{"num_unsolved", &M::num_unsolved, Range{0, kMaxWaypoints}},
      Field{"num_unsolved_values", &M::num_unsolved_values, CountOf{&M::unsolved, INT32_MAX},
            &UnsolvedWaypointsAreWhole},
      Field{"unsolved", &M::unsolved, Each{Finite{}}},
      Field{"num_trace_bytes", &M::num_trace_bytes, CountOf{&M::trace, kMaxTraceBytes}},
      Field{"trace", &M::trace}};
};

template <>
struct Description<legopt_msg::result_reply> {
  using M = legopt_msg::result_reply;
  static constexpr std::tuple kRows{Field{"status", &M::status, ValueOf<ResultStatus>{}},
                                    Field{"message", &M::message, ForHumans(kTextBytes)}};
};

}  // namespace legopt::bus::fields
