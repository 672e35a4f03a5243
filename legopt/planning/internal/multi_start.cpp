#include "legopt/planning/internal/multi_start.h"

namespace legopt {
namespace {

/// Returns whether attempt `a` is the better result.
bool Better(const SolverResult& a, const SolverResult& b) {
  if (a.feasible != b.feasible) return a.feasible;
  return a.value.IsFinite() && !(b.value.max_violation <= a.value.max_violation);
}

}  // namespace

MultiStartResult SolveWithRestarts(Solver& solver, Program& program, const Eigen::VectorXd& start,
                                   const MultiStartSettings& settings) {
  MultiStartResult result;
  Eigen::VectorXd x;
  const SolverContext all{settings.stop, nullptr, settings.history, settings.stamp};
  const size_t first_record = NumRecords(all);
  bool waypoint_unsolved = true;  // until an attempt solves each waypoint
  for (int restart = 0; restart <= settings.max_restarts; ++restart) {
    std::mt19937_64 generator = settings.generator(restart);
    x = start;
    if (restart > 0) settings.perturb(generator, x);
    const StepStamp stamp = [&settings, restart](IterationRecord& step) {
      step.restart = restart;
      if (settings.stamp) settings.stamp(step);
    };
    SolverContext context{settings.stop, &generator, settings.history, stamp};
    context.restart = restart;
    const SolverResult attempt = solver.Solve(program, x, context);
    result.restarts = restart;
    result.effort += attempt;
    waypoint_unsolved = waypoint_unsolved && attempt.waypoint_unsolved;
    if (restart == 0 || Better(attempt, result.best)) {
      result.best = attempt;
      result.x = x;
    }
    if (settings.attempted) settings.attempted(restart + 1);
    if (IsStopped(attempt.status)) {
      result.best.status = attempt.status;
      result.best.budget_spent = attempt.budget_spent;
    }
    if (IsStopped(attempt.status) || attempt.feasible) break;
  }
  result.best.waypoint_unsolved = waypoint_unsolved;
  CloseHistory(all, first_record, result.best.value);
  return result;
}

std::string WorstTermName(const Program& program, const SolverResult& result) {
  if (result.feasible || result.value.worst_term < 0) return "";
  return program.terms()[static_cast<size_t>(result.value.worst_term)]->shape().name;
}

std::string WorstTerm(const std::string& name) { return name.empty() ? "" : "largest violation: " + name; }

}  // namespace legopt
