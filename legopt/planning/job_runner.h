#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "legopt/dataset/dataset.h"
#include "legopt/judge/judge.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/solvers/methods/method.h"
#include "legopt/solvers/solver.h"
#include "legopt/types/task.h"

namespace legopt {

/// One solve of one problem by one method: everything besides the dataset that determines the solution.
struct Job {
  Task task{};
  Initialization initialization = Initialization::kGood;
  int problem_id = 0;                 ///< id within the task's problems of the dataset
  int repetition = 0;                 ///< >= 0; part of the seed of all random numbers
  std::uint64_t experiment_seed = 0;  ///< part of the seed of all random numbers
  Method method;                      ///< must be valid
  /// Number of term evaluations at which the solver stops and returns its best point; 0: no limit.
  std::int64_t effort_limit = 0;
  /// Safety limit, > 0. Runs that it stops (SolveStatus::kTimeLimit) do not count as results of the method.
  double wall_limit_s = std::numeric_limits<double>::infinity();
};

/// Callbacks of a running job. Empty functions are not called. They are called on the thread of the job, must be quick,
/// because they count as solving time, and must not throw.
struct JobHooks {
  std::function<bool()> cancelled;         ///< returns true to stop soon, with status kCancelled
  std::function<void(int, int)> progress;  ///< (done, total) restarts or windows
  std::function<void()> judging;           ///< called when the solver has returned and the judge starts
};

/// The solver's outcome and the judge's verdict. For a motion with an unsolved window, the verdict is
/// Verdict::kWindowUnsolved by every rule, and the figures are those of the window's best point. Except for the
/// measured times, identical (dataset content, job) give identical bits on every worker of one build, unless the clock
/// or a user stopped the job.
struct JobResult {
  Task task{};
  SolveOutcome solve;     ///< outcome reported by the solver
  Evaluation evaluation;  ///< verdict of the judge, which defines success
};

/// Runs jobs on one dataset, one after the other: solves, then judges.
///
/// Construction builds the collision model (seconds for a large mesh), so that its time is not charged to a job, and
/// throws InputError if a mesh is corrupt. The dataset is shared. `registry` contains the solvers that methods may
/// name. One thread at a time.
class JobRunner {
 public:
  explicit JobRunner(std::shared_ptr<const Dataset> dataset, SolverRegistry registry = {});

  const Dataset& dataset() const { return *dataset_; }

  /// Runs a job. Throws InputError if the dataset has no such problem, and std::bad_alloc if memory is exhausted. A
  /// numerical failure of the solver is an outcome, not an exception.
  JobResult Run(const Job& job, const JobHooks& hooks = {});

 private:
  Evaluation JudgeUnsolved(Task task, const ProblemDefinition& problem, const SolveOutcome& solve);

  std::shared_ptr<const Dataset> dataset_;
  ProblemSolver solver_;
  Judge judge_;
};

/// Runs one job without keeping anything for later jobs. Throws as JobRunner.
JobResult RunJob(std::shared_ptr<const Dataset> dataset, const Job& job, const JobHooks& hooks = {});

}  // namespace legopt
