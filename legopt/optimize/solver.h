#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <random>
#include <vector>

#include "legopt/demand.h"
#include "legopt/optimize/penalty_objective.h"
#include "legopt/optimize/solve_outcome.h"
#include "legopt/program/program.h"

namespace legopt {

/// Asked between iterations: the status to stop with, one of IsStopped(), or nothing to go on. May be empty. Asked at
/// the same points of every repetition of a solve, so that what it counts by effort ends that at the same one.
using StopCheck = std::function<std::optional<SolveStatus>()>;

/// Completes the record of a trial step with what the solver does not know: window, restart, effort and time so far.
/// May be empty.
using StepStamp = std::function<void(IterationRecord&)>;

/// What one attempt of a solver may use besides the program. The generator is the attempt's own: every random draw
/// comes from it.
struct SolverContext {
  StopCheck stop;                                   ///< asked between iterations
  std::mt19937_64* generator = nullptr;             ///< not null for solvers that draw (Method::draws)
  std::vector<IterationRecord>* history = nullptr;  ///< receives the trial steps; may be null
  StepStamp stamp = {};                             ///< of the records in the history
  int start = 0;                                    ///< number of the descent within the attempt, from 0

  /// Adds a trial step to the history, if there is one: the only way into it.
  void Record(IterationRecord step) const;

  /// What the stop check says now; nothing when it is empty.
  std::optional<SolveStatus> Stopped() const { return stop ? stop() : std::nullopt; }

  /// The generator, for a solver that draws.
  std::mt19937_64& Draws() const {
    Demand(generator != nullptr, "a solver that draws is given a generator");
    return *generator;
  }
};

/// Records so far; 0 without a history.
size_t NumRecords(const SolverContext& context);

/// What one attempt produced, and its effort.
struct SolverResult : Effort {
  SolverResult() { starts = 1; }

  SolveStatus status = SolveStatus::kNotRun;  ///< by the solver's own word
  ObjectiveValue value;                       ///< at the returned point
  bool feasible = false;                      ///< every violation below the method's tolerance, converged or not
  bool budget_spent = false;                  ///< the method's own budget of time ended it: kTimeLimit
};

/// Ends the history of a solve whose first record is number `first_record`: if it has any, the last accepted one is
/// then the returned point. For solvers, and rows of attempts, that may go on from the best point that they met: when
/// they have, that point gets one more record, with the penalty at the end, and with restart and start of when it was
/// met.
void CloseHistory(const SolverContext& context, size_t first_record, const ObjectiveValue& returned);

/// An optimiser of the paper's penalty problem, min F(x) + mu V(x) with growing mu. It knows terms, not robots.
///
/// A workspace that may be used for one program after the other; one thread; no allocation inside an iteration once
/// buffers have grown (history excepted).
class Solver {
 public:
  virtual ~Solver() = default;

  /// Starts from x (num_waypoints * point_size, any point) and leaves the best point found there: within the bounds,
  /// feasible if any feasible one was found, else of smallest violation as far as the solver knows. A point where the
  /// terms are not finite is never returned, unless the start was one (then status kNumericalFailure).
  virtual SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) = 0;
};

}  // namespace legopt
