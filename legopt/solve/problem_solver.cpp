#include "legopt/solve/problem_solver.h"

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "legopt/blake2b.h"
#include "legopt/input_error.h"
#include "legopt/optimize/registry.h"
#include "legopt/problem/initial_guess.h"
#include "legopt/problem/waypoint_program.h"
#include "legopt/solve/solve_timer.h"

namespace legopt {
namespace {

constexpr double kRadiansPerDegree = M_PI / 180.0;

/// Everything that may decide a random draw, hashed: equal on every machine.
std::mt19937_64 Generator(Task task, int problem_id, Initialization initialization, const std::string& method_hash,
                          const SolveSettings& settings, int restart) {
  const std::string identity = std::to_string(settings.experiment_seed) + "/" + std::string(ToString(task)) + "/" +
                               std::to_string(problem_id) + "/" + std::string(ToString(initialization)) + "/" +
                               method_hash + "/" + std::to_string(settings.repetition) + "/" + std::to_string(restart);
  constexpr size_t kSeedDigits = 16;
  constexpr int kHexadecimal = 16;
  return std::mt19937_64(std::stoull(Blake2bHex(identity).substr(0, kSeedDigits), nullptr, kHexadecimal));
}

/// True when attempt `a` is the better one to return: feasible first, then the smaller violation.
bool Better(const SolverResult& a, const SolverResult& b) {
  if (a.feasible != b.feasible) return a.feasible;
  return a.value.IsFinite() && !(b.value.max_violation <= a.value.max_violation);
}

std::string WorstTerm(const Program& program, const SolverResult& result) {
  if (result.feasible || result.value.worst_term < 0) return "";
  return "largest violation: " + program.terms()[static_cast<size_t>(result.value.worst_term)]->shape().name;
}

}  // namespace

ProblemSolver::ProblemSolver(std::shared_ptr<const Dataset> dataset)
    : dataset_(std::move(dataset)), query_(dataset_->collision_model()) {}

SolveOutcome ProblemSolver::Solve(Task task, int problem_id, Initialization initialization, const Method& method,
                                  const SolveSettings& settings) {
  const Dataset& dataset = *dataset_;
  const ProblemDefinition& problem = dataset.problem(task, problem_id);
  if (task != Task::kPosture) {
    throw InputError(
        {method.name, "task", std::string(ToString(task)), "no method solves this task", "use posture problems"});
  }
  const Stance& stance = problem.stances.front();
  const std::unique_ptr<WaypointProgram> program =
      WaypointProgram::Posture(dataset, query_, stance, {method.collision_margin_m, method.contact_range_m});
  const std::string method_hash = method.Hash();

  const SolveTimer timer;
  const auto stop = [&]() {
    constexpr double kMicros = 1e6;
    if (settings.cancelled && settings.cancelled()) return SolveStatus::kCancelled;
    return static_cast<double>(timer.wall_us()) > settings.wall_limit_s * kMicros ? SolveStatus::kTimeLimit
                                                                                  : SolveStatus::kNotRun;
  };
  const Eigen::VectorXd start = InitialGuess(dataset, stance, initialization);
  const std::unique_ptr<Solver> solver = MakeSolver(method);
  SolveOutcome outcome;
  SolverResult best;
  Eigen::VectorXd best_x, x;
  for (int restart = 0; restart <= method.multi_starts; ++restart) {
    x = start;
    std::mt19937_64 generator = Generator(task, problem_id, initialization, method_hash, settings, restart);
    if (restart > 0) {
      PerturbJoints(dataset.robot(), generator, method.restart_noise_deg * kRadiansPerDegree, x);
    }
    const size_t first_record = outcome.history.size();
    const SolverResult result = solver->Solve(*program, x, {stop, &generator, &outcome.history});
    for (size_t i = first_record; i < outcome.history.size(); ++i) outcome.history[i].restart = restart;
    outcome.restarts = restart;
    outcome.iterations += result.iterations;
    if (restart == 0 || Better(result, best)) {
      best = result;
      best_x = x;
    }
    if (settings.progress) settings.progress(restart + 1, method.multi_starts + 1);
    const bool stopped = result.status == SolveStatus::kTimeLimit || result.status == SolveStatus::kCancelled;
    if (stopped) best.status = result.status;
    if (stopped || result.feasible) break;
  }
  outcome.wall_us = timer.wall_us();
  outcome.cpu_us = timer.cpu_us();
  outcome.involuntary_context_switches = timer.involuntary_context_switches();
  outcome.status = best.status;
  outcome.cost = best.value.cost;
  outcome.max_violation = best.value.max_violation;
  outcome.waypoints = {best_x};
  outcome.message = WorstTerm(*program, best);
  return outcome;
}

}  // namespace legopt
