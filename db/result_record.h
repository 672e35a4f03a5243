#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "words/result.h"

/// A result, and the columns of the table `results` that hold it, each described once: the SQL text of the statements
/// that write it, their binding, the check before it is stored, what is kept of a result that came too late, the copy
/// out of a worker's message (server/result_message.cpp) and the columns of `legopt show` follow from kResultColumns.
/// Thread rule: none, values and constants.
namespace legopt::db {

/// What a worker reports of a finished attempt: the solver's word, and beside it the judge's.
/// Floating-point fields that are not finite mean "not available" and become NULL.
struct ResultRecord {
  SolveStatus solver_status = SolveStatus::kNotRun;
  int iterations = 0;
  int restarts = 0;
  int starts = 0;                      ///< points that a descent was begun from; 0: not counted
  std::int64_t term_evaluations = 0;   ///< for values or derivatives; 0: not counted
  std::int64_t collision_queries = 0;  ///< of the solver; 0: not counted
  std::int64_t wall_us = 0;            ///< of the solve, restarts included, loading excluded
  std::int64_t cpu_us = 0;
  std::int64_t involuntary_context_switches = 0;
  std::int64_t peak_memory_bytes = 0;
  double solver_cost = 0;
  double solver_violation = 0;
  Verdict verdict_literal = Verdict::kWrongWaypointCount;
  Verdict verdict_strict = Verdict::kWrongWaypointCount;
  Verdict verdict_solid = Verdict::kWrongWaypointCount;
  std::string verdict_detail;
  int failed_waypoint = -1;  ///< -1: none
  double cost = 0;           ///< per waypoint, by the judge; finite when a verdict is kSuccess
  double foot_violation = 0;
  double com_violation_m = 0;
  double limit_violation = 0;
  double environment_depth_m = 0;
  double self_depth_literal_m = 0;
  double self_depth_strict_m = 0;
  double solid_depth_m = 0;   ///< by the solid rule, >= 0
  double longest_step_m = 0;  ///< of a point of the robot between consecutive waypoints, >= 0
  // Between consecutive waypoints, see legopt/evaluate/interpolation.h; not finite where the task has nothing there.
  double interpolation_environment_depth_m = std::numeric_limits<double>::quiet_NaN();
  double interpolation_self_depth_m = std::numeric_limits<double>::quiet_NaN();
  double interpolation_free_share = std::numeric_limits<double>::quiet_NaN();  ///< of the transitions, 0 .. 1
  int windows = 0;         ///< that the motion was cut into; 0: not solved by windows
  int windows_solved = 0;  ///< 0 .. windows
  /// Of a motion with Verdict::kWindowUnsolved: the judge's verdict on the best point of that window.
  std::optional<Verdict> window_verdict;
  int num_waypoints = 1;  ///< divisor of cost and time (constraint waypoints of the problem), not rows of `waypoints`
  int waypoint_size = 0;  ///< numbers per waypoint, n + 7
  std::vector<double> waypoints;    ///< row by row; a multiple of waypoint_size, may be empty
  int first_unsolved = 0;           ///< number of the first waypoint of `unsolved` in the motion, >= 0
  int num_unsolved = 0;             ///< number of waypoints in `unsolved`
  std::vector<double> unsolved;     ///< best point of the window without a solution, row by row; may be empty
  std::vector<std::uint8_t> trace;  ///< as the worker sent it (docs/database.md#traces); empty: there is none

  bool SolvedBy(Rule rule) const;  ///< whether the verdict by `rule` is kSuccess
};

/// A column that holds a member of the record. Made with its name and member, then told what else is so:
///
///     ResultColumn{"windows", &ResultRecord::windows}.AtLeast(0).NullWhen(HasNoWindows)
template <class Value>
struct ResultColumn {
  constexpr ResultColumn(std::string_view column_name, Value ResultRecord::*column_member)
      : name(column_name), shown_as(column_name), shown_sql(column_name), member(column_member) {}

  /// The schema refuses anything else; NULL is legal besides.
  constexpr ResultColumn AtLeast(double value) const { return Within(value, std::numeric_limits<double>::infinity()); }
  constexpr ResultColumn Within(double low, double high) const {
    static_assert(std::is_arithmetic_v<Value>);
    ResultColumn column = *this;
    column.least = low;
    column.most = high;
    return column;
  }
  /// Stored as NULL for such a record.
  constexpr ResultColumn NullWhen(bool (*condition)(const ResultRecord&)) const {
    ResultColumn column = *this;
    column.is_null = condition;
    return column;
  }
  /// The table `stale_results` has it, too.
  constexpr ResultColumn AlsoStale() const {
    ResultColumn column = *this;
    column.also_stale = true;
    return column;
  }
  /// Its name in `legopt show`, and what is shown there in its place.
  constexpr ResultColumn ShownAs(std::string_view title, std::string_view sql) const {
    ResultColumn column = *this;
    column.shown_as = title;
    column.shown_sql = sql;
    return column;
  }

  std::string_view name;       ///< in the table, and of the field of result_request that it comes from
  std::string_view shown_as;   ///< its name in `legopt show`
  std::string_view shown_sql;  ///< what is shown there
  Value ResultRecord::*member;
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool (*is_null)(const ResultRecord&) = nullptr;
  bool also_stale = false;
};

/// A column that is shown among the others, but is not of the record: the schema or the statement gives its value.
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

/// In the order of `legopt show`. The solution (waypoints) is in a table of its own.
inline constexpr std::tuple kResultColumns{
    ResultColumn{"solver_status", &ResultRecord::solver_status}.AlsoStale(),
    ResultColumn{"iterations", &ResultRecord::iterations}.AtLeast(0).AlsoStale(),
    ResultColumn{"restarts", &ResultRecord::restarts}.AtLeast(0),
    ResultColumn{"starts", &ResultRecord::starts}.AtLeast(0).NullWhen(IsZero<&ResultRecord::starts>),
    ResultColumn{"term_evaluations", &ResultRecord::term_evaluations}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::term_evaluations>),
    ResultColumn{"collision_queries", &ResultRecord::collision_queries}.AtLeast(0).NullWhen(
        IsZero<&ResultRecord::collision_queries>),
    ResultColumn{"solver_cost", &ResultRecord::solver_cost},
    ResultColumn{"solver_violation", &ResultRecord::solver_violation},
    ResultColumn{"verdict_literal", &ResultRecord::verdict_literal}.AlsoStale(),
    ResultColumn{"verdict_strict", &ResultRecord::verdict_strict}.AlsoStale(),
    ResultColumn{"verdict_solid", &ResultRecord::verdict_solid},
    ResultColumn{"verdict_detail", &ResultRecord::verdict_detail}.AlsoStale(),
    ResultColumn{"failed_waypoint", &ResultRecord::failed_waypoint}.NullWhen(HasNoFailedWaypoint),
    ResultColumn{"num_waypoints", &ResultRecord::num_waypoints}.AtLeast(1).AlsoStale(),
    ResultColumn{"cost", &ResultRecord::cost}.AlsoStale(),
    OtherResultColumn{"time_s"},
    ResultColumn{"wall_us", &ResultRecord::wall_us}.AtLeast(0).AlsoStale(),
    ResultColumn{"cpu_us", &ResultRecord::cpu_us}.AtLeast(0).AlsoStale(),
    ResultColumn{"involuntary_context_switches", &ResultRecord::involuntary_context_switches}.AtLeast(0),
    ResultColumn{"peak_memory_bytes", &ResultRecord::peak_memory_bytes}.AtLeast(0),
    ResultColumn{"foot_violation", &ResultRecord::foot_violation},
    ResultColumn{"com_violation_m", &ResultRecord::com_violation_m},
    ResultColumn{"limit_violation", &ResultRecord::limit_violation},
    ResultColumn{"environment_depth_m", &ResultRecord::environment_depth_m},
    ResultColumn{"self_depth_literal_m", &ResultRecord::self_depth_literal_m},
    ResultColumn{"self_depth_strict_m", &ResultRecord::self_depth_strict_m},
    ResultColumn{"solid_depth_m", &ResultRecord::solid_depth_m}.AtLeast(0),
    ResultColumn{"longest_step_m", &ResultRecord::longest_step_m}.AtLeast(0),
    ResultColumn{"windows", &ResultRecord::windows}.AtLeast(0).NullWhen(HasNoWindows),
    ResultColumn{"windows_solved", &ResultRecord::windows_solved}.AtLeast(0).NullWhen(HasNoWindows),
    ResultColumn{"window_verdict", &ResultRecord::window_verdict}.NullWhen(HasNoWindowVerdict),
    ResultColumn{"interpolation_environment_depth_m", &ResultRecord::interpolation_environment_depth_m}.AtLeast(0),
    ResultColumn{"interpolation_self_depth_m", &ResultRecord::interpolation_self_depth_m}.AtLeast(0),
    ResultColumn{"interpolation_free_share", &ResultRecord::interpolation_free_share}.Within(0, 1),
    OtherResultColumn{"attempt"},
    ResultColumn{"trace", &ResultRecord::trace}.NullWhen(HasNoTrace).ShownAs("trace_bytes", "length(trace)")};

/// Calls `visit` with each ResultColumn, in their order.
template <class Visit>
constexpr void ForEachResultColumn(const Visit& visit) {
  const auto visit_own = [&visit](const auto& column) {
    if constexpr (requires { column.member; }) visit(column);
  };
  std::apply([&](const auto&... columns) { (visit_own(columns), ...); }, kResultColumns);
}

/// The list of columns, as SELECT has it, that `legopt show` shows of a row of `results`.
std::string ShownResultColumns();

/// Why the schema would refuse the result (a number out of range, a success without cost); empty when it is legal.
/// Whoever takes results from others asks before storing.
std::string FaultOf(const ResultRecord& result);

}  // namespace legopt::db
