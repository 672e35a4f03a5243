#pragma once

#include <cstdint>

#include "words/words.h"

namespace legopt {

/// How a solve ended, by the solver's own word. Success is only what the judge says.
enum class SolveStatus : std::uint8_t {
  kNotRun,               ///< nothing has been solved yet
  kConvergedFeasible,    ///< converged, all constraints within the solver's tolerance
  kConvergedInfeasible,  ///< no progress possible at the largest penalty, constraints violated ("stuck")
  kIterationLimit,       ///< the iterations ran out; the point may be feasible
  kEffortLimit,          ///< the job's evaluations ran out, on every machine at the same one; the point may be feasible
  kTimeLimit,            ///< the clock ended it: a result only where the method has a budget of time (budget_s)
  kNumericalFailure,     ///< non-finite values at the start, or no subproblem could be solved
  kCancelled,            ///< the stop check asked for it
};

template <>
inline constexpr auto kWords<SolveStatus> = Words<SolveStatus>({{SolveStatus::kNotRun, "not_run"},
                                                                {SolveStatus::kConvergedFeasible, "converged_feasible"},
                                                                {SolveStatus::kConvergedInfeasible,
                                                                 "converged_infeasible"},
                                                                {SolveStatus::kIterationLimit, "iteration_limit"},
                                                                {SolveStatus::kEffortLimit, "effort_limit"},
                                                                {SolveStatus::kTimeLimit, "time_limit"},
                                                                {SolveStatus::kNumericalFailure, "numerical_failure"},
                                                                {SolveStatus::kCancelled, "cancelled"}});

/// Whether a stop check ended the solve: further starts of the same job must not follow.
constexpr bool IsStopped(SolveStatus status) {
  return status == SolveStatus::kEffortLimit || status == SolveStatus::kTimeLimit || status == SolveStatus::kCancelled;
}

/// Why a solution fails, or that it does not. In the order in which one waypoint is checked; containment and step occur
/// under Rule::kSolid only.
enum class Verdict : std::uint8_t {
  kSuccess,               ///< feasible by this rule
  kWrongWaypointCount,    ///< not as many waypoints as the task wants
  kWindowUnsolved,        ///< the solver ended at a window of the motion without a solution of it
  kWrongSize,             ///< a waypoint that is not n + 7 numbers; of a path in time also stamps out of place
  kNotFinite,             ///< a waypoint with NaN or infinity
  kFootPose,              ///< a foot is off its target
  kCom,                   ///< the centre of mass is outside the support polygon
  kJointLimit,            ///< a joint is beyond its limits
  kEnvironmentCollision,  ///< a link is in the scene
  kSelfCollision,         ///< two links are in each other
  kContainment,  ///< a link is inside of a closed body, or a body inside of a link, whose surfaces may not cross
  kStep,         ///< a link moves too far from the waypoint before
};

template <>
inline constexpr auto kWords<Verdict> = Words<Verdict>({{Verdict::kSuccess, "success"},
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

/// Which of the judge's verdicts counts. Each rule demands all that the one before does, and more.
enum class Rule : std::uint8_t {
  kLiteral,  ///< the original evaluator's
  kStrict,   ///< every colliding pair of its list, and every contact
  kSolid     ///< what a robot could do: bodies are solid, no link jumps
};

template <>
inline constexpr auto kWords<Rule> =
    Words<Rule>({{Rule::kLiteral, "literal"}, {Rule::kStrict, "strict"}, {Rule::kSolid, "solid"}});

}  // namespace legopt
