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

/// Asked between iterations: the status to stop with (kTimeLimit, kCancelled), or nothing to go on. May be empty.
using StopCheck = std::function<std::optional<SolveStatus>()>;

/// What one attempt of a solver may use besides the program. The generator is the attempt's own: every random draw
/// comes from it. `history` receives the trial steps and may be null.
struct SolverContext {
  StopCheck stop;                                   ///< asked between iterations
  std::mt19937_64* generator = nullptr;             ///< not null for solvers that draw (Method::draws)
  std::vector<IterationRecord>* history = nullptr;  ///< may be null

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
};

/// Ends the history of a solve whose first record is number `first_record`: if it has any, the last accepted one is
/// then the returned point. For solvers that may go on from the best point that they met: when they have, that point
/// gets one more record, with the penalty at the end.
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
