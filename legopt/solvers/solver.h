#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/types/invariant.h"
#include "legopt/types/result.h"

namespace legopt {

/// Selection of the terms that an iteration evaluates (paper, section IV).
struct Sampling {
  int percent = 100;         ///< share of the program's terms that is refreshed per iteration, 1..100
  bool incremental = false;  ///< terms that are not refreshed keep their last gradient or model
};

/// Exact values of a program's objective at one point. The penalty objective of the paper is F + mu V; preferences add
/// to F.
struct ObjectiveValue {
  double cost = 0.0;           ///< F = sum of squares of the cost terms
  double preference = 0.0;     ///< P = sum weight max(0, p) of the preferences
  double violation = 0.0;      ///< V = sum |h| + sum max(0, g)
  double max_violation = 0.0;  ///< largest single |h_i| or max(0, g_i), which is compared with tolerances
  int worst_term = -1;         ///< index of the term with max_violation; -1 when there is none

  /// Adds the residuals of one more term.
  void Add(const TermShape& shape, int term, const std::vector<double>& residuals);

  /// Returns F + P, the objective that is minimised subject to the constraints.
  double Objective() const { return cost + preference; }
  /// Returns the penalty objective F + P + mu V, `penalty` = mu >= 0.
  double Merit(double penalty) const { return Objective() + penalty * violation; }
  /// Returns whether F, P and V are finite.
  bool IsFinite() const;
};

/// Evaluates all terms of `program` at x. `scratch` is a reusable buffer. Non-finite terms make the value non-finite.
ObjectiveValue EvaluateObjective(Program& program, Eigen::Ref<const Eigen::VectorXd> x, std::vector<double>& scratch);

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
  std::int64_t work_ns = 0;            ///< these calls, each with the weight of its term (Term::weight_ns)
  std::int64_t collision_queries = 0;  ///< queries answered by the solver's CollisionQuery

  /// Adds the counts of another attempt.
  Effort& operator+=(const Effort& other) {
    iterations += other.iterations;
    starts += other.starts;
    term_evaluations += other.term_evaluations;
    work_ns += other.work_ns;
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
  double margin_relaxed = 0.0;             ///< SolverResult::margin_relaxed, the maximum over solved windows and paths
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

/// Check that is called between iterations. Returns the status to stop with, one of IsStopped(), or nothing to
/// continue. May be empty. Solvers call it at the same points in every repetition of a solve, so that limits on effort
/// end the solve at the same point.
using StopCheck = std::function<std::optional<SolveStatus>()>;

/// Completes the record of a trial step with data that the solver does not have: window, restart, effort and time so
/// far. May be empty.
using StepStamp = std::function<void(IterationRecord&)>;

/// Resources of one attempt of a solver besides the program. The attempt has its own generator, from which all random
/// numbers come.
struct SolverContext {
  StopCheck stop;                                   ///< called between iterations
  std::mt19937_64* generator = nullptr;             ///< not null for solvers that use random numbers (Method::draws)
  std::vector<IterationRecord>* history = nullptr;  ///< receives the trial steps; may be null
  StepStamp stamp = {};                             ///< completes the records of the history
  int start = 0;                                    ///< index of the descent within the attempt, from 0
  int restart = 0;                                  ///< index of the attempt at this program, 0: the first

  /// Adds a trial step to the history, if there is one. All records must be added by this function.
  void Record(IterationRecord step) const;

  /// Returns the current answer of the stop check; nothing if there is no check.
  std::optional<SolveStatus> Stopped() const { return stop ? stop() : std::nullopt; }

  /// Returns the generator, which solvers that use random numbers require.
  std::mt19937_64& rng() const {
    CheckInvariant(generator != nullptr, "a solver that draws is given a generator");
    return *generator;
  }
};

/// Returns the number of records so far; 0 without a history.
size_t NumRecords(const SolverContext& context);

/// Result of one attempt, and its effort.
struct SolverResult : Effort {
  SolverResult() { starts = 1; }

  SolveStatus status = SolveStatus::kNotRun;  ///< status reported by the solver
  ObjectiveValue value;                       ///< value at the returned point
  bool feasible = false;                      ///< every violation below the method's tolerance, converged or not
  double margin_relaxed = 0.0;                ///< share of the terms' margins that was relaxed for the feasible point
                                              ///< (Term::RelaxMargin), 0 .. 1
  bool budget_spent = false;                  ///< the method's own time budget ended the attempt: kTimeLimit
  /// A waypoint has no solution even without the others, as far as the solver knows. Then going back cannot help.
  bool waypoint_unsolved = false;
};

/// Completes the history of a solve whose first record has index `first_record`, so that the last accepted record is
/// the returned point. For solvers and sequences of attempts that may return an earlier best point: that point then
/// gets one more record, with the last penalty and with the restart and start that found it. Does nothing if the solve
/// has no records.
void CloseHistory(const SolverContext& context, size_t first_record, const ObjectiveValue& returned);

/// Optimiser of the paper's penalty problem, min F(x) + mu V(x) with growing mu. It depends on terms, not on robots.
///
/// A workspace that may be used for one program after the other; one thread; iterations do not allocate once buffers
/// have grown (history excepted).
class Solver {
 public:
  virtual ~Solver() = default;

  /// Starts at x (num_waypoints * point_size, any point) and replaces x with the best point found. That point lies
  /// within the bounds. It is feasible if any feasible point was found, else it has the smallest violation known to the
  /// solver. A point with non-finite terms is never returned, unless the initial x was one (status kNumericalFailure).
  virtual SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) = 0;

  /// Returns how often a planner may go back when it finds no solution of a window, and solve it together with earlier
  /// stances, whose waypoints then move again. Default: never, as in the paper.
  virtual int max_backtracks() const { return 0; }
};

}  // namespace legopt
