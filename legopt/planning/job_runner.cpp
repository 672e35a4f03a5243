#include "legopt/planning/job_runner.h"

#include <string>
#include <utility>

#include "legopt/judge/internal/diagnostic.h"

namespace legopt {
namespace {

/// Returns "window 1 of 3 (stances 5 to 10) unsolved: waypoint 12: ...", with windows, stances and waypoints
/// counted from 0.
std::string DescribeUnsolved(const SolveOutcome& solve, const std::string& judged) {
  const UnsolvedWindow& window = *solve.unsolved;
  const std::string name = "window " + std::to_string(solve.windows_solved) + " of " + std::to_string(solve.windows) +
                           " (stances " + std::to_string(window.first_stance) + " to " +
                           std::to_string(window.first_stance + window.num_stances - 1) + ") ";
  if (window.waypoints.empty()) return name + "not begun: " + std::string(ToString(solve.status));
  const std::string term = window.worst_term.empty() ? ""
                                                     : "; largest violation in the solver: " + window.worst_term +
                                                           ", " + NumberText(window.max_violation);
  const std::string ended = IsStopped(solve.status) ? ", ended by " + std::string(ToString(solve.status)) : "";
  return name + "unsolved" + ended + ": " +
         (judged.empty() ? "every constraint holds within the judge's tolerances" : judged) + term;
}

}  // namespace

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
  result.task = job.task;
  result.solve = solver_.Solve(job.task, job.problem_id, job.initialization, job.method, settings);
  if (hooks.judging) hooks.judging();
  result.evaluation = result.solve.unsolved ? JudgeUnsolved(job.task, problem, result.solve)
                                            : judge_.Evaluate(job.task, problem, result.solve.waypoints);
  return result;
}

/// Returns the verdict of a motion that ended at an unsolved window. The window's best point is judged for its figures
/// and the detail; it never counts as solved.
Evaluation JobRunner::JudgeUnsolved(Task task, const ProblemDefinition& problem, const SolveOutcome& solve) {
  const UnsolvedWindow& window = *solve.unsolved;
  Evaluation evaluation;
  if (!window.waypoints.empty()) {
    evaluation = judge_.EvaluatePart(task, problem, window.first_stance, window.waypoints);
    evaluation.window = evaluation.first_failure();
  }
  evaluation.literal = evaluation.strict = evaluation.solid = evaluation.physical = Verdict::kWindowUnsolved;
  evaluation.cost = Evaluation::kNotEvaluated;
  evaluation.num_waypoints = NumWaypoints(task, static_cast<int>(problem.stances.size()));
  evaluation.detail = DescribeUnsolved(solve, evaluation.detail);
  return evaluation;
}

JobResult RunJob(std::shared_ptr<const Dataset> dataset, const Job& job, const JobHooks& hooks) {
  return JobRunner(std::move(dataset)).Run(job, hooks);
}

}  // namespace legopt
