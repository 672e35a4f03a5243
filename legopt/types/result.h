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

/// Known feasibility of a stance or problem, independent of any method (docs/reference/datasets.md#certificates).
enum class Feasibility : std::uint8_t {
  kCertified,   ///< a posture that the judge accepts is known for every stance
  kInfeasible,  ///< a stance is proven to have no posture
  kOpen,        ///< neither is known
};

template <>
inline constexpr auto kEnumNames<Feasibility> = MakeEnumNames<Feasibility>({{Feasibility::kCertified, "certified"},
                                                                            {Feasibility::kInfeasible, "infeasible"},
                                                                            {Feasibility::kOpen, "open"}});

/// Constraints of a stance that can be disabled together to find the conflicting ones.
enum class ConstraintGroup : std::uint8_t {
  kBalance,      ///< centre of mass over the support polygon
  kSelf,         ///< collision between links
  kEnvironment,  ///< collision with the scene
};

template <>
inline constexpr auto kEnumNames<ConstraintGroup> =
    MakeEnumNames<ConstraintGroup>({{ConstraintGroup::kBalance, "balance"},
                                    {ConstraintGroup::kSelf, "self"},
                                    {ConstraintGroup::kEnvironment, "scene"}});

}  // namespace legopt
