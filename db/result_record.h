#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "legopt/types/check.h"
#include "legopt/types/result.h"

/// A result, and the columns of the table `results`, each described once in kResultColumns. It generates the SQL that
/// writes results, the binding of values, the checks before storing, the columns of `stale_results`, the copying from a
/// worker's message (server/result_message.cpp) and the columns of `legopt show`. Thread rule: none, values and
/// constants.
namespace legopt::db {

/// A worker's report of a finished attempt: the solver's status and the judge's verdicts. Non-finite floating-point
/// fields mean "not available" and become NULL.
struct ResultRecord {
  SolveStatus solver_status = SolveStatus::kNotRun;
  int iterations = 0;
  int restarts = 0;
  int starts = 0;                      ///< number of initial guesses that were optimized; 0: not counted
  std::int64_t term_evaluations = 0;   ///< evaluations of values or derivatives; 0: not counted
  std::int64_t collision_queries = 0;  ///< queries by the solver; 0: not counted
  std::int64_t work_ns = 0;            ///< weighted evaluations; 0: not counted
  double margin_relaxed = 0.0;         ///< largest share of the terms' margins that was relaxed for the solution
  std::int64_t wall_us = 0;            ///< wall time of the solve, including restarts, excluding loading
  std::int64_t cpu_us = 0;
  std::int64_t involuntary_context_switches = 0;
  std::int64_t peak_memory_bytes = 0;
  double solver_cost = 0;
  double solver_violation = 0;
  Verdict verdict_literal = Verdict::kWrongWaypointCount;
  Verdict verdict_strict = Verdict::kWrongWaypointCount;
  Verdict verdict_solid = Verdict::kWrongWaypointCount;
  Verdict verdict_physical = Verdict::kWrongWaypointCount;
  std::string verdict_detail;
  int failed_waypoint = -1;
  double cost = 0;                    ///< cost per waypoint, computed by the judge; finite if any verdict is kSuccess
  std::vector<Violation> violations;  ///< largest values of the judge's checks, stored in a table of their own
  // Values between consecutive waypoints, see legopt/judge/internal/path_examiner.h; not finite if the task has none.
  double interpolation_environment_depth_m = std::numeric_limits<double>::quiet_NaN();
  double interpolation_self_depth_m = std::numeric_limits<double>::quiet_NaN();
  double interpolation_free_share = std::numeric_limits<double>::quiet_NaN();  ///< share of collision-free transitions,
                                                                               ///< 0 .. 1
  // Static equilibrium at and half way between waypoints, see HoldingScore; 0 postures: not tested.
  int holding_postures = 0;
  int holding_without_equilibrium = 0;
  int holding_over_torque = 0;
  int halfway_postures = 0;
  int halfway_without_equilibrium = 0;
  int halfway_over_torque = 0;
  // Shortest time law of a timed motion, see MotionTiming; not finite if there is none.
  double duration_s = std::numeric_limits<double>::quiet_NaN();              ///< T*
  double reduced_duration_s = std::numeric_limits<double>::quiet_NaN();      ///< T* with reduced friction and efforts
  double velocity_limited_share = std::numeric_limits<double>::quiet_NaN();  ///< shares of T* by the nearest limit,
                                                                             ///< 0 .. 1
  double torque_limited_share = std::numeric_limits<double>::quiet_NaN();
  double contact_limited_share = std::numeric_limits<double>::quiet_NaN();
  int windows = 0;         ///< number of windows of the motion; 0: not solved by windows
  int windows_solved = 0;  ///< 0 .. windows
  /// For motions with Verdict::kWindowUnsolved: the judge's verdict on the best point of that window.
  std::optional<Verdict> window_verdict;
  int num_waypoints = 1;  ///< divisor of cost and time (constraint waypoints of the problem), not the number of rows of
                          ///< `waypoints`
  int waypoint_size = 0;  ///< numbers per waypoint, n + 7
  std::vector<double> waypoints;  ///< row-major; the size is a multiple of waypoint_size and may be 0
  int first_unsolved = 0;         ///< index in the motion of the first waypoint of `unsolved`, >= 0
  int num_unsolved = 0;
  std::vector<double> unsolved;     ///< best point of the window without a solution, row-major; may be empty
  std::vector<std::uint8_t> trace;  ///< binary trace sent by the worker; empty if none

  bool SolvedBy(Rule rule) const;  ///< true if the verdict by `rule` is kSuccess
};

/// A column that stores a member of the record. Construct it from name and member, then add further properties:
///
///     ResultColumn{"windows", &ResultRecord::windows}.AtLeast(0).NullWhen(HasNoWindows)
template <class Value>
struct ResultColumn {
  constexpr ResultColumn(std::string_view column_name, Value ResultRecord::*column_member)
      : name(column_name), shown_as(column_name), shown_sql(column_name), member(column_member) {}

  /// Sets the range that the schema allows; NULL is always allowed.
  constexpr ResultColumn AtLeast(double value) const { return Within(value, std::numeric_limits<double>::infinity()); }
  constexpr ResultColumn Within(double low, double high) const {
    static_assert(std::is_arithmetic_v<Value>);
    ResultColumn column = *this;
    column.least = low;
    column.most = high;
    return column;
  }
  /// Stores NULL for records that satisfy `condition`.
  constexpr ResultColumn NullWhen(bool (*condition)(const ResultRecord&)) const {
    ResultColumn column = *this;
    column.is_null = condition;
    return column;
  }
  /// Includes the column in the table `stale_results`.
  constexpr ResultColumn AlsoStale() const {
    ResultColumn column = *this;
    column.also_stale = true;
    return column;
  }
  /// Sets the column's title and SQL expression in `legopt show`.
  constexpr ResultColumn ShownAs(std::string_view title, std::string_view sql) const {
    ResultColumn column = *this;
    column.shown_as = title;
    column.shown_sql = sql;
    return column;
  }

  std::string_view name;       ///< column name, and name of the field of result_request that it is read from
  std::string_view shown_as;   ///< title in `legopt show`
  std::string_view shown_sql;  ///< SQL expression in `legopt show`
  Value ResultRecord::*member;
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool (*is_null)(const ResultRecord&) = nullptr;
  bool also_stale = false;
};

/// A displayed column that is not a member of the record: its value comes from the schema or the statement.
struct OtherResultColumn {
  std::string_view name;
};

template <auto member>
constexpr bool IsZero(const ResultRecord& r) {
  return r.*member == 0;
}
constexpr bool HasNoFailedWaypoint(const ResultRecord& r) { return r.failed_waypoint < 0; }
constexpr bool HasNoWindows(const ResultRecord& r) { return r.windows <= 0; }
constexpr bool HasNoWindowVerdict(const ResultRecord& r) { return !r.window_verdict; }
constexpr bool HasNoTrace(const ResultRecord& r) { return r.trace.empty(); }

/// Columns in the order of `legopt show`. The solution (waypoints) is stored in a separate table.
inline constexpr std::tuple kResultColumns{
    ResultColumn{"solver_status", &ResultRecord::solver_status}.AlsoStale(),
    ResultColumn{"iterations", &ResultRecord::iterations}.AtLeast(0).AlsoStale(),
    ResultColumn{"restarts", &ResultRecord::restarts}.AtLeast(0),
    ResultColumn{"starts", &ResultRecord::starts}.AtLeast(0).NullWhen(IsZero<&ResultRecord::starts>),
    ResultColumn{"term_evaluations", &ResultRecord::term_evaluations}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::term_evaluations>),
    ResultColumn{"collision_queries", &ResultRecord::collision_queries}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::collision_queries>),
    ResultColumn{"work_ns", &ResultRecord::work_ns}.AtLeast(0).NullWhen(IsZero<&ResultRecord::work_ns>),
    ResultColumn{"margin_relaxed", &ResultRecord::margin_relaxed}.Within(0, 1),
    ResultColumn{"solver_cost", &ResultRecord::solver_cost},
    ResultColumn{"solver_violation", &ResultRecord::solver_violation},
    ResultColumn{"verdict_literal", &ResultRecord::verdict_literal}.AlsoStale(),
    ResultColumn{"verdict_strict", &ResultRecord::verdict_strict}.AlsoStale(),
    ResultColumn{"verdict_solid", &ResultRecord::verdict_solid},
    ResultColumn{"verdict_physical", &ResultRecord::verdict_physical},
    ResultColumn{"verdict_detail", &ResultRecord::verdict_detail}.AlsoStale(),
    ResultColumn{"failed_waypoint", &ResultRecord::failed_waypoint}.NullWhen(HasNoFailedWaypoint),
    ResultColumn{"num_waypoints", &ResultRecord::num_waypoints}.AtLeast(1).AlsoStale(),
    ResultColumn{"cost", &ResultRecord::cost}.AlsoStale(),
    OtherResultColumn{"time_s"},
    ResultColumn{"wall_us", &ResultRecord::wall_us}.AtLeast(0).AlsoStale(),
    ResultColumn{"cpu_us", &ResultRecord::cpu_us}.AtLeast(0).AlsoStale(),
    ResultColumn{"involuntary_context_switches", &ResultRecord::involuntary_context_switches}.AtLeast(0),
    ResultColumn{"peak_memory_bytes", &ResultRecord::peak_memory_bytes}.AtLeast(0),
    ResultColumn{"windows", &ResultRecord::windows}.AtLeast(0).NullWhen(HasNoWindows),
    ResultColumn{"windows_solved", &ResultRecord::windows_solved}.AtLeast(0).NullWhen(HasNoWindows),
    ResultColumn{"window_verdict", &ResultRecord::window_verdict}.NullWhen(HasNoWindowVerdict),
    ResultColumn{"interpolation_environment_depth_m", &ResultRecord::interpolation_environment_depth_m}.AtLeast(0),
    ResultColumn{"interpolation_self_depth_m", &ResultRecord::interpolation_self_depth_m}.AtLeast(0),
    ResultColumn{"interpolation_free_share", &ResultRecord::interpolation_free_share}.Within(0, 1),
    ResultColumn{"holding_postures", &ResultRecord::holding_postures}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::holding_postures>),
    ResultColumn{"holding_without_equilibrium", &ResultRecord::holding_without_equilibrium}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::holding_postures>),
    ResultColumn{"holding_over_torque", &ResultRecord::holding_over_torque}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::holding_postures>),
    ResultColumn{"halfway_postures", &ResultRecord::halfway_postures}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::halfway_postures>),
    ResultColumn{"halfway_without_equilibrium", &ResultRecord::halfway_without_equilibrium}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::halfway_postures>),
    ResultColumn{"halfway_over_torque", &ResultRecord::halfway_over_torque}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::halfway_postures>),
    ResultColumn{"duration_s", &ResultRecord::duration_s}.AtLeast(0),
    ResultColumn{"reduced_duration_s", &ResultRecord::reduced_duration_s}.AtLeast(0),
    ResultColumn{"velocity_limited_share", &ResultRecord::velocity_limited_share}.Within(0, 1),
    ResultColumn{"torque_limited_share", &ResultRecord::torque_limited_share}.Within(0, 1),
    ResultColumn{"contact_limited_share", &ResultRecord::contact_limited_share}.Within(0, 1),
    OtherResultColumn{"attempt"},
    ResultColumn{"trace", &ResultRecord::trace}.NullWhen(HasNoTrace).ShownAs("trace_bytes", "length(trace)")};

/// Calls `visit` with each ResultColumn in order.
template <class Visit>
constexpr void ForEachResultColumn(const Visit& visit) {
  const auto visit_own = [&visit](const auto& column) {
    if constexpr (requires { column.member; }) visit(column);
  };
  std::apply([&](const auto&... columns) { (visit_own(columns), ...); }, kResultColumns);
}

/// Returns the SELECT list of the columns of `results` that `legopt show` displays.
std::string ShownResultColumns();

/// Returns why the schema would refuse the result (a number out of range, a success without cost); empty if it is
/// legal. Must be called before untrusted results are stored.
std::string FaultOf(const ResultRecord& result);

}  // namespace legopt::db
