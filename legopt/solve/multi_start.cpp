#include "legopt/solve/multi_start.h"

namespace legopt {
namespace {

/// True when attempt `a` is the better one to return.
bool Better(const SolverResult& a, const SolverResult& b) {
  if (a.feasible != b.feasible) return a.feasible;
  return a.value.IsFinite() && !(b.value.max_violation <= a.value.max_violation);
}

}  // namespace

MultiStartResult SolveWithRestarts(Solver& solver, Program& program, const Eigen::VectorXd& start,
                                   const MultiStartSettings& settings) {
  MultiStartResult result;
  Eigen::VectorXd x;
  for (int restart = 0; restart <= settings.max_restarts; ++restart) {
    std::mt19937_64 generator = settings.generator(restart);
    x = start;
    if (restart > 0) settings.perturb(generator, x);
    const size_t first_record = settings.history == nullptr ? 0 : settings.history->size();
    const SolverResult attempt = solver.Solve(program, x, {settings.stop, &generator, settings.history});
    for (size_t i = first_record; settings.history != nullptr && i < settings.history->size(); ++i) {
      (*settings.history)[i].restart = restart;
    }
    result.restarts = restart;
    result.effort += attempt;
    if (restart == 0 || Better(attempt, result.best)) {
      result.best = attempt;
      result.x = x;
    }
    if (settings.attempted) settings.attempted(restart + 1);
    const bool stopped = attempt.status == SolveStatus::kTimeLimit || attempt.status == SolveStatus::kCancelled;
    if (stopped) result.best.status = attempt.status;
    if (stopped || attempt.feasible) break;
  }
  return result;
}

}  // namespace legopt
