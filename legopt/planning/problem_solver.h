#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "legopt/dataset/dataset.h"
#include "legopt/geometry/collision_query.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/task.h"

namespace legopt {

/// Settings of a solve besides dataset, problem and method.
struct SolveSettings {
  std::uint64_t experiment_seed = 1;  ///< part of the seed of all random numbers
  int repetition = 0;                 ///< >= 0; part of the seed of all random numbers
  std::int64_t effort_limit = 0;      ///< maximum number of term evaluations: kEffortLimit; 0: no limit
  /// Safety limit, > 0, checked between iterations: kTimeLimit, which does not count as a result of the method.
  double wall_limit_s = std::numeric_limits<double>::infinity();
  std::function<bool()> cancelled;  ///< polled between iterations; may be empty
  /// Called with finished and total windows or, for tasks without windows, with finished and allowed attempts; may be
  /// empty.
  std::function<void(int done, int total)> progress;
};

/// Solves problems of one dataset, one after the other, by any method: one attempt from the initial guess, then up to
/// `method.multi_starts` from perturbed ones (docs/explanation/paper.md#restarts) until one ends feasible.
///
/// Windowed tasks are solved window by window (docs/explanation/paper.md#motion-windows); restarts are per window. If a
/// window exhausts them, the solve ends. The outcome then has the waypoints of the windows before it and, separately,
/// the best point of that window; its message names window and term.
///
/// Deterministic, unless a clock or a user stopped the solve: all random numbers come from generators seeded by
/// (experiment seed, task, problem, initialisation, repetition, window, restart), the same for all methods (common
/// random numbers). Earlier solves have no influence. One thread at a time.
class ProblemSolver {
 public:
  /// Builds the dataset's collision model of solids if it does not exist yet, and its own collision query. Those of the
  /// surface and of all pairs are built at their first use, outside of the measured time. `registry` contains the
  /// solvers that methods may name.
  explicit ProblemSolver(std::shared_ptr<const Dataset> dataset, SolverRegistry registry = {});

  /// Solves a problem of the dataset. Throws InputError if there is no such problem or the method is not valid
  /// (Method::Validate).
  SolveOutcome Solve(Task task, int problem_id, Initialization initialization, const Method& method,
                     const SolveSettings& settings);
  /// Solves a problem that need not belong to the dataset. Its links must be feet of the dataset (InputError).
  SolveOutcome Solve(Task task, const ProblemDefinition& problem, Initialization initialization, const Method& method,
                     const SolveSettings& settings);

 private:
  class Run;

  CollisionQuery& Query(SceneRepresentation representation, PairSelection pairs);

  std::shared_ptr<const Dataset> dataset_;
  SolverRegistry registry_;
  EnumArray<SceneRepresentation, EnumArray<PairSelection, std::unique_ptr<CollisionQuery>>>
      queries_;  ///< built at first use
};

}  // namespace legopt
