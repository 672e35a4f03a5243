#include "legopt/planning/internal/problem_run.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "legopt/math/blake2b.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr double kRadiansPerDegree = M_PI / 180.0;
/// Distance of the points of a curve from joint limits, rad or m: between them, the spline goes beyond its points by
/// some of it.
constexpr double kJointReserve = 2e-3;
/// Earlier stances that are solved again with a window, more each time that it has no solution.
constexpr int kStancesBack = 3;

std::mt19937_64 GeneratorOf(const std::string& identity) {
  constexpr size_t kSeedDigits = 16;
  constexpr int kHexadecimal = 16;
  return std::mt19937_64(*ParseInteger<std::uint64_t>(Blake2bHex(identity).substr(0, kSeedDigits), kHexadecimal));
}

}  // namespace

// The effort limit is checked first: a solve that reaches it ends there, unless the clock stopped it earlier.
std::optional<SolveStatus> ProblemSolver::Run::Stopped() const {
  constexpr double kMicros = 1e6;
  if (settings_.cancelled && settings_.cancelled()) return SolveStatus::kCancelled;
  if (settings_.effort_limit > 0 && Evaluations() >= settings_.effort_limit) return SolveStatus::kEffortLimit;
  const bool late = static_cast<double>(timer_.wall_us()) > settings_.wall_limit_s * kMicros;
  return late ? std::optional(SolveStatus::kTimeLimit) : std::nullopt;
}

ProgramOptions ProblemSolver::Run::OptionsOfPrograms() const {
  ProgramOptions proximity;
  proximity.margin_m = method_.collision_margin_m;
  proximity.range_m = method_.contact_range_m;
  proximity.continuous = method_.continuous_collision;
  proximity.continuous_weight = method_.continuous_weight;
  proximity.physics = method_.physics;
  if (HasTimeLaw(task_.task)) {  // demands equilibrium everywhere, whatever the method asks for
    if (method_.physics == Physics::kNone) proximity.physics = Physics::kBalance;
    proximity.segment_physics = proximity.physics;
    proximity.prefer_middle = true;
    proximity.joint_reserve = kJointReserve;
  }
  return proximity;
}

void ProblemSolver::Run::Perturb(std::mt19937_64& generator, Ends ends, Eigen::VectorXd& x) const {
  const Eigen::Index size = dataset_.robot().configuration_size();
  const Eigen::Index end = x.size() / size - (ends == Ends::kBothFixed ? 1 : 0);
  for (Eigen::Index t = ends == Ends::kFree ? 0 : 1; t < end; ++t) {
    PerturbJoints(dataset_.robot(), generator, method_.restart_noise_deg * kRadiansPerDegree,
                  x.segment(t * size, size));
  }
}

MultiStartSettings ProblemSolver::Run::Attempts(std::string identity, int window, Ends ends) {
  MultiStartSettings attempts;
  attempts.max_restarts = method_.multi_starts;
  attempts.generator = [identity = std::move(identity)](int restart) {
    return GeneratorOf(identity + std::to_string(restart));
  };
  attempts.perturb = [this, ends](std::mt19937_64& generator, Eigen::VectorXd& x) { Perturb(generator, ends, x); };
  if (!task_.windowed && settings_.progress) {
    attempts.attempted = [this](int made) { settings_.progress(made, method_.multi_starts + 1); };
  }
  attempts.stop = [this] { return Stopped(); };
  attempts.history = &outcome_.history;
  attempts.stamp = [this, window](IterationRecord& step) {
    step.window = window;
    step.evaluations = Evaluations();
    step.elapsed_us = timer_.wall_us();
  };
  return attempts;
}

void ProblemSolver::Run::Account(const WindowResult& result) {
  const MultiStartResult& attempts = result.attempts;
  outcome_.restarts += attempts.restarts;
  outcome_ += attempts.effort;
  // Several windows: status of the first that did not converge, or of the one that ended the solve.
  const bool converged = outcome_.status == SolveStatus::kNotRun || outcome_.status == SolveStatus::kConvergedFeasible;
  if (converged || !attempts.best.feasible || attempts.stopped()) outcome_.status = attempts.best.status;
  outcome_.budget_spent = attempts.best.budget_spent;
  std::erase_if(accuracies_, [&](const WindowAccuracy& accuracy) {  // windows that this one replaces
    return attempts.best.feasible && accuracy.first_stance >= result.window.first_stance;
  });
  accuracies_.push_back({result.window.first_stance, attempts.best.value.max_violation, attempts.best.margin_relaxed});
  outcome_.max_violation = outcome_.margin_relaxed = 0.0;
  for (const WindowAccuracy& accuracy : accuracies_) {
    outcome_.max_violation = std::max(outcome_.max_violation, accuracy.max_violation);
    outcome_.margin_relaxed = std::max(outcome_.margin_relaxed, accuracy.margin_relaxed);
  }
}

SolveOutcome ProblemSolver::Run::Finish() {
  outcome_.wall_us = timer_.wall_us();
  outcome_.cpu_us = timer_.cpu_us();
  outcome_.collision_queries = query_.queries() - first_query_;
  outcome_.involuntary_context_switches = timer_.involuntary_context_switches();
  return std::move(outcome_);
}

/// Returns the initial guess of a window: the waypoints that were solved before, then guesses. The first stance of a
/// window was solved with the window before.
Eigen::VectorXd ProblemSolver::Run::WindowStart(const StanceWindow& window, std::span<const Stance> stances) const {
  const Eigen::Index size = dataset_.robot().configuration_size();
  const int count = NumWaypoints(task_.task, static_cast<int>(stances.size()));
  const auto first = static_cast<size_t>(NumWaypoints(task_.task, window.first_stance));
  // The last waypoints of the window before had other constraints: those of its end.
  const size_t free_again = static_cast<size_t>(task_.waypoints_per_stance - 1);
  const size_t solved = outcome_.waypoints.size() - std::min(outcome_.waypoints.size(), free_again);
  const bool repeats = GuessRepeatsInMotions(dataset_);
  Eigen::VectorXd x(count * size);
  for (int t = 0; t < count; ++t) {
    const size_t waypoint = first + static_cast<size_t>(t);
    if (waypoint < solved) {
      x.segment(t * size, size) = outcome_.waypoints[waypoint];
    } else if (t > 0 && repeats) {
      x.segment(t * size, size) = x.segment((t - 1) * size, size);
    } else {
      const Stance& stance = stances[static_cast<size_t>(StanceOfWaypoint(task_.task, t))];
      x.segment(t * size, size) = InitialGuess(dataset_, stance, initialization_);
    }
  }
  return x;
}

void ProblemSolver::Run::KeepWindow(const StanceWindow& window, const Eigen::VectorXd& x) {
  const Eigen::Index size = dataset_.robot().configuration_size();
  outcome_.waypoints.resize(static_cast<size_t>(NumWaypoints(task_.task, window.first_stance)));
  for (Eigen::Index t = 0; t < x.size() / size; ++t) outcome_.waypoints.emplace_back(x.segment(t * size, size));
}

/// `x` is the best point of the window; empty if the window was not started.
void ProblemSolver::Run::KeepUnsolved(const StanceWindow& window, const Eigen::VectorXd& x) {
  const Eigen::Index size = dataset_.robot().configuration_size();
  UnsolvedWindow& unsolved = outcome_.unsolved.emplace();
  unsolved.first_stance = window.first_stance;
  unsolved.num_stances = window.num_stances;
  for (Eigen::Index t = 0; t < x.size() / size; ++t) unsolved.waypoints.emplace_back(x.segment(t * size, size));
}

std::string ProblemSolver::Run::WindowName(const StanceWindow& window, int index) const {
  return "window " + std::to_string(index) + " of " + std::to_string(outcome_.windows) + " (stances " +
         std::to_string(window.first_stance) + " to " + std::to_string(window.first_stance + window.num_stances - 1) +
         "), ";
}

/// Solves the program of a window's stances. `identity` determines the noise of restarts; `first_restart` is the number
/// of the first attempt.
ProblemSolver::Run::WindowResult ProblemSolver::Run::SolveStances(const ProblemDefinition& problem,
                                                                  const StanceWindow& window, int index,
                                                                  const std::string& identity, int first_restart) {
  const std::span<const Stance> stances =
      std::span(problem.stances)
          .subspan(static_cast<size_t>(window.first_stance), static_cast<size_t>(window.num_stances));
  const bool fixed_first = window.first_stance > 0;
  const auto program = MakeTaskProgram(task_.task, dataset_, query_, stances, OptionsOfPrograms(), fixed_first);
  program_ = program.get();
  MultiStartSettings attempts = Attempts(identity, index, fixed_first ? Ends::kFirstFixed : Ends::kFree);
  attempts.stamp = [stamp = attempts.stamp, first_restart](IterationRecord& step) {
    step.restart += first_restart;
    stamp(step);
  };
  WindowResult result{.window = window, .attempts = {}, .worst_term = {}};
  result.attempts = SolveWithRestarts(*solver_, *program, WindowStart(window, stances), attempts);
  outcome_.term_evaluations = Evaluations();
  outcome_.work_ns = Work_ns();
  program_ = nullptr;
  result.worst_term = WorstTermName(*program, result.attempts.best);
  return result;
}

/// Solves a window without a solution together with earlier stances, which may have led into a dead end. Replaces
/// `result` if that succeeds; adds the effort otherwise.
void ProblemSolver::Run::Backtrack(const ProblemDefinition& problem, int index, WindowResult* result) {
  const StanceWindow window = result->window;
  for (int k = 1; k <= solver_->max_backtracks(); ++k) {
    const int back = std::min(k * kStancesBack, window.first_stance);
    const SolverResult& best = result->attempts.best;
    if (back <= (k - 1) * kStancesBack || best.feasible || best.waypoint_unsolved || IsStopped(best.status)) return;
    const StanceWindow wider{window.first_stance - back, window.num_stances + back};
    const std::string identity = Identity(problem, index) + "back/" + std::to_string(k) + "/";
    WindowResult another = SolveStances(problem, wider, index, identity, result->attempts.restarts + 1);
    if (another.attempts.best.feasible) std::swap(*result, another);
    result->attempts.effort += another.attempts.effort;
    result->attempts.restarts += another.attempts.restarts + 1;
    if (another.attempts.stopped()) {
      result->attempts.best.status = another.attempts.best.status;
      result->attempts.best.budget_spent = another.attempts.best.budget_spent;
    }
  }
}

/// Solves one window. Returns false if the window failed or was stopped, which ends the problem. The best point is kept
/// even if it is infeasible; for windows, apart from the waypoints of the solved windows.
bool ProblemSolver::Run::SolveWindow(const ProblemDefinition& problem, const StanceWindow& window, int index) {
  const SolverContext all{{}, nullptr, &outcome_.history, Attempts("", index, Ends::kFree).stamp};
  const size_t first_record = NumRecords(all);
  WindowResult result = SolveStances(problem, window, index, Identity(problem, index), 0);
  Backtrack(problem, index, &result);
  CloseHistory(all, first_record, result.attempts.best.value);
  Account(result);
  const SolverResult& best = result.attempts.best;
  const bool failed = !best.feasible;
  if (failed) {
    outcome_.message = (task_.windowed ? WindowName(result.window, index) : "") + WorstTerm(result.worst_term);
  }
  if (failed && task_.windowed) {
    KeepUnsolved(result.window, result.attempts.x);
    outcome_.unsolved->worst_term = result.worst_term;
    outcome_.unsolved->max_violation = best.value.max_violation;
    return false;
  }
  KeepWindow(result.window, result.attempts.x);
  window_costs_ += best.value.cost;
  if (task_.windowed) {
    ++outcome_.windows_solved;
    if (settings_.progress) settings_.progress(outcome_.windows_solved, outcome_.windows);
  }
  return !failed && !result.attempts.stopped();
}

SolveOutcome ProblemSolver::Run::Solve(const ProblemDefinition& problem) {
  const std::vector<StanceWindow> windows = StanceWindows(task_.task, static_cast<int>(problem.stances.size()));
  if (task_.windowed) outcome_.windows = static_cast<int>(windows.size());
  for (int index = 0; index < std::ssize(windows); ++index) {
    if (!SolveWindow(problem, windows[static_cast<size_t>(index)], index)) break;
  }
  // The solve was stopped after a solved window.
  if (outcome_.windows_solved < outcome_.windows && !outcome_.unsolved) {
    KeepUnsolved(windows[static_cast<size_t>(outcome_.windows_solved)], {});
  }
  outcome_.cost = SolutionCost(task_.task, dataset_.robot(), outcome_.waypoints, window_costs_);
  if (HasTimeStamps(task_.task)) SolveSegments(problem);
  return Finish();
}

}  // namespace legopt
