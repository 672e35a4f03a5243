#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "legopt/problem/program.h"
#include "legopt/solvers/penalty_objective.h"
#include "legopt/solvers/solve_outcome.h"
#include "legopt/types/demand.h"

namespace legopt {

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
  bool budget_spent = false;                  ///< the method's own time budget ended the attempt: kTimeLimit
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
};

}  // namespace legopt
