#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "legopt/collision/collision_query.h"
#include "legopt/dataset/dataset.h"
#include "legopt/methods/method.h"
#include "legopt/optimize/solve_outcome.h"
#include "words/task.h"

namespace legopt {

/// What a solve depends on besides dataset, problem and method.
struct SolveSettings {
  std::uint64_t experiment_seed = 1;  ///< enters the seed of every random draw
  int repetition = 0;                 ///< >= 0; likewise
  std::int64_t effort_limit = 0;      ///< term evaluations, checked between iterations: kEffortLimit; 0: none
  /// A safety net, checked between iterations: kTimeLimit, which is no result of the method; > 0.
  double wall_limit_s = std::numeric_limits<double>::infinity();
  std::function<bool()> cancelled;  ///< polled between iterations; may be empty
  /// Windows finished of all windows, of a task without them attempts finished of attempts allowed; may be empty.
  std::function<void(int done, int total)> progress;
};

/// Solves problems of one dataset, one after the other, by any method: one attempt from the initial guess, then up to
/// `method.multi_starts` from perturbed ones (docs/readings.md#restarts) until one ends feasible.
///
/// A task that is described so is solved window by window (docs/readings.md#motion-windows); restarts are per window. A
/// window that exhausts them ends the problem: the outcome holds the waypoints of the windows before it and, apart from
/// them, the best point of that window; its message names window and term.
///
/// Deterministic, but for what a clock or a person stopped: all random draws come from generators seeded by (experiment
/// seed, task, problem, initialisation, repetition, window, restart), the same for all methods (common random numbers);
/// what was solved before has no influence.
/// One thread at a time.
class ProblemSolver {
 public:
  /// Builds the dataset's collision model of solids when nobody has yet, and its own collision query; those of the
  /// surface and of all pairs at their first use, outside of the measured time. `registry` has the solvers that methods
  /// may name.
  explicit ProblemSolver(std::shared_ptr<const Dataset> dataset, SolverRegistry registry = {});

  /// Throws InputError when the dataset has no such problem or the method is not valid (Method::Validate).
  SolveOutcome Solve(Task task, int problem_id, Initialization initialization, const Method& method,
                     const SolveSettings& settings);
  /// The same for a problem that is not (yet) one of the dataset's. Its links must be feet of the dataset (InputError).
  SolveOutcome Solve(Task task, const ProblemDefinition& problem, Initialization initialization, const Method& method,
                     const SolveSettings& settings);

 private:
  class Run;

  CollisionQuery& Query(SceneRepresentation representation, PairSelection pairs);

  std::shared_ptr<const Dataset> dataset_;
  SolverRegistry registry_;
  Per<SceneRepresentation, Per<PairSelection, std::unique_ptr<CollisionQuery>>> queries_;  ///< built when asked for
};

}  // namespace legopt
