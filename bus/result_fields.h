#pragma once

#include <algorithm>
#include <cmath>

#include "bus/field.h"
#include "bus/field_limits.h"
#include "bus/field_rules.h"
#include "bus/messages.h"
#include "legopt/types/job.h"
#include "legopt/types/reply.h"

/// @file
/// Fields of the call result, which reports the outcome of an attempt. PROTOCOL.md, section 9.

namespace legopt::bus::fields {

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
        .Require(!(m.interpolation_free_share < 0 || m.interpolation_free_share > 1),
                 "interpolation_free_share: must be within 0 .. 1");
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
      Field{"wall_us", &M::wall_us, AtLeast{0}},
      Field{"cpu_us", &M::cpu_us, AtLeast{0}},
      Field{"involuntary_context_switches", &M::involuntary_context_switches, AtLeast{0}},
      Field{"peak_memory_bytes", &M::peak_memory_bytes, AtLeast{0}},
      Field{"solver_cost", &M::solver_cost, NanOrFinite{}},
      Field{"solver_violation", &M::solver_violation, NanOrFinite{}},
      Field{"verdict_literal", &M::verdict_literal, Text{0, kEnumNameBytes}},
      Field{"verdict_strict", &M::verdict_strict, Text{0, kEnumNameBytes}},
      Field{"verdict_solid", &M::verdict_solid, Text{0, kEnumNameBytes}},
      Field{"verdict_detail", &M::verdict_detail, ForHumans(kTextBytes)},
      Field{"failed_waypoint", &M::failed_waypoint, AtLeast{-1}},
      Field{"cost", &M::cost, NanOrFinite{}},
      Field{"num_violations", &M::num_violations, CountOf{&M::violations, kMaxViolations}},
      Field{"violations", &M::violations},
      Field{"interpolation_environment_depth_m", &M::interpolation_environment_depth_m, NanOrFinite{}},
      Field{"interpolation_self_depth_m", &M::interpolation_self_depth_m, NanOrFinite{}},
      Field{"interpolation_free_share", &M::interpolation_free_share, NanOrFinite{}, &InterpolationIsPossible},
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
