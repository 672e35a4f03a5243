#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "words/result.h"

namespace legopt {

/// One trial step of an optimiser. Of the records of one attempt, and of all attempts at a window, the last accepted
/// one is the returned point; when none is accepted, the start is returned. All but `elapsed_us` is the same whenever
/// and wherever the solve is repeated, and nothing depends on that.
struct IterationRecord {
  int step = 0;                  ///< number of the step in the whole solve, from 0
  int window = 0;                ///< in which, from 0; 0 for tasks that are not solved window by window
  int restart = 0;               ///< of this window, 0: the first attempt
  int start = 0;                 ///< of this attempt, 0: the first point that a descent was begun from
  double penalty = 0.0;          ///< mu; 0 for methods without
  double trust_box = 0.0;        ///< half width; 0 for methods without
  double cost = 0.0;             ///< F at the trial point
  double violation = 0.0;        ///< largest single constraint violation at the trial point
  bool accepted = false;         ///< the solver took it
  std::int64_t evaluations = 0;  ///< term evaluations of the whole solve until then
  std::int64_t elapsed_us = 0;   ///< wall time of the solving thread until then, as of SolveOutcome::wall_us
};

/// What a solve has cost, in counts that no load and no machine changes. Efforts of attempts add up.
struct Effort {
  int iterations = 0;                  ///< trial steps; of SQP subproblems, the one that showed convergence included
  int starts = 0;                      ///< points that a descent was begun from; an attempt may begin several times
  std::int64_t term_evaluations = 0;   ///< calls of Term::Evaluate and Term::Linearize
  std::int64_t collision_queries = 0;  ///< answered by the solver's CollisionQuery

  /// Adds the counts of another attempt.
  Effort& operator+=(const Effort& other) {
    iterations += other.iterations;
    starts += other.starts;
    term_evaluations += other.term_evaluations;
    collision_queries += other.collision_queries;
    return *this;
  }
};

/// The window of a motion at which the solve ended.
struct UnsolvedWindow {
  int first_stance = 0;                    ///< number of its first stance, from 0
  int num_stances = 0;                     ///< number of its stances
  std::vector<Eigen::VectorXd> waypoints;  ///< best point found, n + 7 numbers each; empty: the window was not begun
  std::string worst_term;                  ///< term with the largest violation there; empty: none
  double max_violation = 0.0;              ///< that violation, in the unit of the term
};

/// What a solve of one problem produced, and its effort, restarts included.
struct SolveOutcome : Effort {
  SolveStatus status = SolveStatus::kNotRun;  ///< of windows: the first not converged, or the one that ended the solve
  std::vector<Eigen::VectorXd> waypoints;     ///< n + 7 each; the best point found; of windows what was solved
  double cost = 0.0;                          ///< optimiser's own cost of the returned point
  double max_violation = 0.0;                 ///< largest single constraint violation of the returned point
  int restarts = 0;                           ///< attempts beyond the first, of all windows
  int windows = 0;                            ///< 0 for tasks that are not solved window by window
  int windows_solved = 0;                     ///< the first ones; `waypoints` are theirs
  std::optional<UnsolvedWindow> unsolved;     ///< window number `windows_solved`, unless all windows are solved
  bool budget_spent = false;                  ///< the method's own budget of time ended the solve: kTimeLimit
  std::int64_t wall_us = 0;                   ///< of the solving thread, restarts included, loading excluded
  std::int64_t cpu_us = 0;                    ///< CPU time of the solving thread
  /// Of the solving thread: above 0, others had its processor in between.
  std::int64_t involuntary_context_switches = 0;
  std::vector<IterationRecord> history;  ///< the trial steps of all attempts, in their order
  std::string message;                   ///< for humans: what failed, or empty
};

}  // namespace legopt
