#pragma once

#include <cstdint>

#include "legopt/types/enum_names.h"

namespace legopt {

/// How a solve ended according to the solver. Only the judge decides about success.
enum class SolveStatus : std::uint8_t {
  kNotRun,               ///< nothing has been solved yet
  kConvergedFeasible,    ///< converged, all constraints within the solver's tolerance
  kConvergedInfeasible,  ///< constraints violated and no progress possible at the largest penalty ("stuck")
  kIterationLimit,       ///< iteration limit reached; the point may be feasible
  kEffortLimit,       ///< limit of term evaluations reached, at the same evaluation on every machine; the point may be
                      ///< feasible
  kTimeLimit,         ///< wall-time limit reached; a result only if the method has a time budget (budget_s)
  kNumericalFailure,  ///< non-finite values at the initial guess, or no subproblem could be solved
  kCancelled,         ///< cancelled by the stop check
};

template <>
inline constexpr auto kEnumNames<SolveStatus> =
    MakeEnumNames<SolveStatus>({{SolveStatus::kNotRun, "not_run"},
                                {SolveStatus::kConvergedFeasible, "converged_feasible"},
                                {SolveStatus::kConvergedInfeasible, "converged_infeasible"},
                                {SolveStatus::kIterationLimit, "iteration_limit"},
                                {SolveStatus::kEffortLimit, "effort_limit"},
                                {SolveStatus::kTimeLimit, "time_limit"},
                                {SolveStatus::kNumericalFailure, "numerical_failure"},
                                {SolveStatus::kCancelled, "cancelled"}});

/// Returns whether a stop check ended the solve. The job must not continue with another random restart then.
constexpr bool IsStopped(SolveStatus status) {
  return status == SolveStatus::kEffortLimit || status == SolveStatus::kTimeLimit || status == SolveStatus::kCancelled;
}

/// Verdict on a solution: success or the first failed check, in the order of the checks of a waypoint. Containment and
/// step occur only under Rule::kSolid.
enum class Verdict : std::uint8_t {
  kSuccess,               ///< feasible under this rule
  kWrongWaypointCount,    ///< the number of waypoints is not the one that the task requires
  kWindowUnsolved,        ///< the solver did not solve a window of the motion
  kWrongSize,             ///< a waypoint does not have n + 7 numbers; for a path in time also: invalid time stamps
  kNotFinite,             ///< a waypoint contains NaN or infinity
  kFootPose,              ///< a foot is off its target
  kCom,                   ///< the centre of mass is outside the support polygon
  kJointLimit,            ///< a joint is beyond its limits
  kEnvironmentCollision,  ///< a link collides with the scene
  kSelfCollision,         ///< two links collide
  kContainment,  ///< a link is inside a closed body, or a body inside a link; their surfaces need not intersect
  kStep,         ///< a link moves too far between consecutive waypoints
};

template <>
inline constexpr auto kEnumNames<Verdict> =
    MakeEnumNames<Verdict>({{Verdict::kSuccess, "success"},
                            {Verdict::kWrongWaypointCount, "wrong_waypoint_count"},
                            {Verdict::kWindowUnsolved, "window_unsolved"},
                            {Verdict::kWrongSize, "wrong_size"},
                            {Verdict::kNotFinite, "not_finite"},
                            {Verdict::kFootPose, "foot_pose"},
                            {Verdict::kCom, "com"},
                            {Verdict::kJointLimit, "joint_limit"},
                            {Verdict::kEnvironmentCollision, "environment_collision"},
                            {Verdict::kSelfCollision, "self_collision"},
                            {Verdict::kContainment, "containment"},
                            {Verdict::kStep, "step"}});

/// Rule by which the judge decides. Each rule includes all checks of the previous one and adds more.
enum class Rule : std::uint8_t {
  kLiteral,  ///< original evaluator's rule
  kStrict,   ///< every listed pair of links, and every contact
  kSolid     ///< physical rule: bodies are solid, links do not jump
};

template <>
inline constexpr auto kEnumNames<Rule> =
    MakeEnumNames<Rule>({{Rule::kLiteral, "literal"}, {Rule::kStrict, "strict"}, {Rule::kSolid, "solid"}});

}  // namespace legopt
