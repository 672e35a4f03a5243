#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "legopt/dataset/dataset.h"
#include "legopt/evaluate/judge.h"
#include "legopt/methods/method.h"
#include "legopt/optimize/solve_outcome.h"
#include "legopt/solve/problem_solver.h"
#include "words/task.h"

namespace legopt {

/// One solve of one problem by one method: everything that decides the solution, besides the dataset.
struct Job {
  Task task{};                                            ///< of the problem
  Initialization initialization = Initialization::kGood;  ///< which start
  int problem_id = 0;                                     ///< within the task's problems of the dataset
  int repetition = 0;                                     ///< >= 0; enters the seed of every random draw
  std::uint64_t experiment_seed = 0;                      ///< the other part of it
  Method method;                                          ///< as validated
  /// Term evaluations from which on the solver stops itself and returns the best it has; 0: none.
  std::int64_t effort_limit = 0;
  /// A safety net, > 0: what it stops (SolveStatus::kTimeLimit) is no result of the method.
  double wall_limit_s = std::numeric_limits<double>::infinity();
};

/// What a running job tells, and asks, its surroundings. Empty functions are not called. Called from the thread that
/// runs the job; they must be quick, for they count as solving time, and must not throw.
struct JobHooks {
  std::function<bool()> cancelled;         ///< true: stop soon, status kCancelled
  std::function<void(int, int)> progress;  ///< (done, total) restarts or windows
  std::function<void()> judging;           ///< the solver has returned, the judge begins
};

/// The solver's outcome and the judge's verdict; of a motion with an unsolved window, the verdict is
/// Verdict::kWindowUnsolved by every rule, and the figures are those of the best point of that window. Except for the
/// measured times, equal (dataset content, job) give identical bits on every worker of one build, unless the clock or a
/// user stopped the job.
struct JobResult {
  Task task{};            ///< task of the job
  SolveOutcome solve;     ///< by the solver's own word
  Evaluation evaluation;  ///< by the judge: what success is
};

/// Runs jobs on one dataset, one after the other: solve, then judge.
///
/// Construction builds the collision model (seconds for a large mesh), so that no job is charged for it, and throws
/// InputError when a mesh is corrupt. The dataset is shared. `registry` has the solvers that methods may name. One
/// thread at a time.
class JobRunner {
 public:
  /// See above for what this costs and throws.
  explicit JobRunner(std::shared_ptr<const Dataset> dataset, SolverRegistry registry = {});

  const Dataset& dataset() const { return *dataset_; }  ///< as given at construction

  /// Throws InputError when the dataset has no such problem and std::bad_alloc when memory ends; a solver that fails
  /// numerically is an outcome, not an exception.
  JobResult Run(const Job& job, const JobHooks& hooks = {});

 private:
  Evaluation JudgeUnsolved(Task task, const ProblemDefinition& problem, const SolveOutcome& solve);

  std::shared_ptr<const Dataset> dataset_;
  ProblemSolver solver_;
  Judge judge_;
};

/// One job, without keeping anything for a next one. As JobRunner.
JobResult RunJob(std::shared_ptr<const Dataset> dataset, const Job& job, const JobHooks& hooks = {});

}  // namespace legopt
