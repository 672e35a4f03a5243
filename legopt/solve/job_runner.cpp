#include "legopt/solve/job_runner.h"

#include <string>
#include <utility>

namespace legopt {

JobRunner::JobRunner(std::shared_ptr<const Dataset> dataset, SolverRegistry registry)
    : dataset_(std::move(dataset)), solver_(dataset_, std::move(registry)), judge_(dataset_) {}

JobResult JobRunner::Run(const Job& job, const JobHooks& hooks) {
  const ProblemDefinition& problem = dataset_->problem(job.task, job.problem_id);
  SolveSettings settings;
  settings.experiment_seed = job.experiment_seed;
  settings.repetition = job.repetition;
  settings.effort_limit = job.effort_limit;
  settings.wall_limit_s = job.wall_limit_s;
  settings.cancelled = hooks.cancelled;
  settings.progress = hooks.progress;

  JobResult result;
  result.solve = solver_.Solve(job.task, job.problem_id, job.initialization, job.method, settings);
  if (hooks.judging) hooks.judging();
  result.evaluation = judge_.Evaluate(job.task, problem, result.solve.waypoints);
  DescribeWindows(&result);
  return result;
}

void DescribeWindows(JobResult* result) {
  const SolveOutcome& solve = result->solve;
  if (result->evaluation.literal != Verdict::kWrongWaypointCount || solve.windows == 0) return;
  result->evaluation.detail +=
      "; " + std::to_string(solve.windows_solved) + " of " + std::to_string(solve.windows) + " windows solved";
}

JobResult RunJob(std::shared_ptr<const Dataset> dataset, const Job& job, const JobHooks& hooks) {
  return JobRunner(std::move(dataset)).Run(job, hooks);
}

}  // namespace legopt
