#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "legopt/types/result.h"

namespace legopt {

/// One trial step of an optimiser. The last accepted record of an attempt, and of all attempts at a window, is the
/// returned point; if none is accepted, the initial guess is returned. All fields except `elapsed_us` are the same
/// whenever and wherever the solve is repeated, and nothing depends on `elapsed_us`.
struct IterationRecord {
  int step = 0;                  ///< number of the step in the whole solve, from 0
  int window = 0;                ///< index of the window, from 0; 0 for tasks that are not solved window by window
  int restart = 0;               ///< restart of this window, 0: first attempt
  int start = 0;                 ///< start within this attempt, 0: first initial guess
  double penalty = 0.0;          ///< mu; 0 for methods without it
  double trust_box = 0.0;        ///< half width; 0 for methods without it
  double cost = 0.0;             ///< F at the trial point
  double violation = 0.0;        ///< largest single constraint violation at the trial point
  bool accepted = false;         ///< the solver moved to the trial point
  std::int64_t evaluations = 0;  ///< term evaluations of the solve so far
  std::int64_t elapsed_us = 0;   ///< wall time of the solve so far, as in SolveOutcome::wall_us
};

/// Cost of a solve in counts that do not depend on load or machine. The efforts of attempts add up.
struct Effort {
  int iterations = 0;                  ///< trial steps; for SQP, subproblems, including the one that showed convergence
  int starts = 0;                      ///< initial points of descents; an attempt may have several
  std::int64_t term_evaluations = 0;   ///< calls of Term::Evaluate and Term::Linearize
  std::int64_t collision_queries = 0;  ///< queries answered by the solver's CollisionQuery

  /// Adds the counts of another attempt.
  Effort& operator+=(const Effort& other) {
    iterations += other.iterations;
    starts += other.starts;
    term_evaluations += other.term_evaluations;
    collision_queries += other.collision_queries;
    return *this;
  }
};

/// Window of a motion at which the solve ended.
struct UnsolvedWindow {
  int first_stance = 0;                    ///< number of its first stance, from 0
  int num_stances = 0;                     ///< number of its stances
  std::vector<Eigen::VectorXd> waypoints;  ///< best point found, n + 7 numbers each; empty: the window was not started
  std::string worst_term;                  ///< term with the largest violation there; empty: none
  double max_violation = 0.0;              ///< violation of worst_term, in its unit
};

/// Result of solving one problem, and its effort including restarts.
struct SolveOutcome : Effort {
  /// With windows: status of the first one that did not converge, or of the one that ended the solve.
  SolveStatus status = SolveStatus::kNotRun;
  std::vector<Eigen::VectorXd> waypoints;  ///< best point found, n + 7 numbers each; with windows: the solved part
  double cost = 0.0;                       ///< optimiser's own cost of the returned point
  double max_violation = 0.0;              ///< largest single constraint violation of the returned point
  int restarts = 0;                        ///< attempts beyond the first, summed over all windows
  int windows = 0;                         ///< 0 for tasks that are not solved window by window
  int windows_solved = 0;                  ///< number of solved windows from the first on; `waypoints` belong to them
  std::optional<UnsolvedWindow> unsolved;  ///< window number `windows_solved`, unless all windows are solved
  bool budget_spent = false;               ///< the method's own time budget ended the solve: kTimeLimit
  std::int64_t wall_us = 0;                ///< wall time of the solving thread, including restarts, excluding loading
  std::int64_t cpu_us = 0;                 ///< CPU time of the solving thread
  /// Involuntary switches of the solving thread; if > 0, it had to share its processor.
  std::int64_t involuntary_context_switches = 0;
  std::vector<IterationRecord> history;  ///< trial steps of all attempts, in order
  std::string message;                   ///< reason of a failure for humans, or empty
};

}  // namespace legopt
