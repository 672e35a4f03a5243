#include "legopt/solve/problem_solver.h"

#include <cmath>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>

#include "legopt/blake2b.h"
#include "legopt/solve/multi_start.h"
#include "legopt/solve/solve_timer.h"
#include "legopt/terms/initial_guess.h"
#include "legopt/terms/motion_windows.h"
#include "legopt/terms/velocity_term.h"
#include "legopt/terms/waypoint_program.h"

namespace legopt {
namespace {

constexpr double kRadiansPerDegree = M_PI / 180.0;

std::mt19937_64 GeneratorOf(const std::string& identity) {
  constexpr size_t kSeedDigits = 16;
  constexpr int kHexadecimal = 16;
  return std::mt19937_64(std::stoull(Blake2bHex(identity).substr(0, kSeedDigits), nullptr, kHexadecimal));
}

std::string WorstTerm(const Program& program, const SolverResult& result) {
  if (result.feasible || result.value.worst_term < 0) return "";
  const TermShape& shape = program.terms()[static_cast<size_t>(result.value.worst_term)]->shape();
  return "largest violation: " + shape.name;
}

}  // namespace

/// One solve.
class ProblemSolver::Run {
 public:
  Run(const Dataset& dataset, CollisionQuery& query, Initialization initialization, const Method& method,
      const SolveSettings& settings, const SolverRegistry& registry)
      : dataset_(dataset),
        query_(query),
        initialization_(initialization),
        method_(method),
        settings_(settings),
        solver_(MakeSolver(method, registry)) {}

  SolveOutcome Posture(const ProblemDefinition& problem);
  SolveOutcome Motion(const ProblemDefinition& problem);

 private:
  /// Everything that may decide a random draw: equal on every machine.
  std::string Identity(Task task, const ProblemDefinition& problem) const {
    return std::to_string(settings_.experiment_seed) + "/" + std::string(ToString(task)) + "/" +
           std::to_string(problem.id) + "/" + std::string(ToString(initialization_)) + "/" + method_.Hash() + "/" +
           std::to_string(settings_.repetition) + "/";
  }
  ContactOptions Contacts() const {
    return {method_.collision_margin_m, method_.contact_range_m, method_.continuous_collision,
            method_.continuous_weight};
  }
  std::optional<SolveStatus> Stopped() const;
  void Perturb(std::mt19937_64& generator, int first_waypoint, Eigen::VectorXd& x) const;
  MultiStartSettings Attempts(std::string identity, int first_waypoint);
  Eigen::VectorXd WindowStart(std::span<const Stance> stances, bool fixed_first) const;
  void KeepWindow(const MotionWindow& window, const Eigen::VectorXd& x);
  void Account(const MultiStartResult& result);
  SolveOutcome Finish();

  const Dataset& dataset_;
  CollisionQuery& query_;
  Initialization initialization_;
  const Method& method_;
  const SolveSettings& settings_;
  std::unique_ptr<Solver> solver_;
  SolveTimer timer_;
  SolveOutcome outcome_;
};

std::optional<SolveStatus> ProblemSolver::Run::Stopped() const {
  constexpr double kMicros = 1e6;
  if (settings_.cancelled && settings_.cancelled()) return SolveStatus::kCancelled;
  const bool late = static_cast<double>(timer_.wall_us()) > settings_.wall_limit_s * kMicros;
  return late ? std::optional(SolveStatus::kTimeLimit) : std::nullopt;
}

void ProblemSolver::Run::Perturb(std::mt19937_64& generator, int first_waypoint, Eigen::VectorXd& x) const {
  const Eigen::Index size = dataset_.robot().configuration_size();
  for (Eigen::Index t = first_waypoint; t < x.size() / size; ++t) {
    PerturbJoints(dataset_.robot(), generator, method_.restart_noise_deg * kRadiansPerDegree,
                  x.segment(t * size, size));
  }
}

MultiStartSettings ProblemSolver::Run::Attempts(std::string identity, int first_waypoint) {
  MultiStartSettings attempts;
  attempts.max_restarts = method_.multi_starts;
  attempts.generator = [identity = std::move(identity)](int restart) {
    return GeneratorOf(identity + std::to_string(restart));
  };
  attempts.perturb = [this, first_waypoint](std::mt19937_64& generator, Eigen::VectorXd& x) {
    Perturb(generator, first_waypoint, x);
  };
  attempts.stop = [this] { return Stopped(); };
  attempts.history = &outcome_.history;
  return attempts;
}

void ProblemSolver::Run::Account(const MultiStartResult& result) {
  outcome_.restarts += result.restarts;
  outcome_.iterations += result.iterations;
  // Of a motion: the first window that did not converge, or the one that ended it.
  const bool converged = outcome_.status == SolveStatus::kNotRun || outcome_.status == SolveStatus::kConvergedFeasible;
  if (converged || !result.best.feasible || result.stopped()) outcome_.status = result.best.status;
  outcome_.max_violation = std::max(outcome_.max_violation, result.best.value.max_violation);
}

SolveOutcome ProblemSolver::Run::Finish() {
  outcome_.wall_us = timer_.wall_us();
  outcome_.cpu_us = timer_.cpu_us();
  outcome_.involuntary_context_switches = timer_.involuntary_context_switches();
  return std::move(outcome_);
}

SolveOutcome ProblemSolver::Run::Posture(const ProblemDefinition& problem) {
  const Stance& stance = problem.stances.front();
  const auto program = WaypointProgram::Posture(dataset_, query_, stance, Contacts());
  MultiStartSettings attempts = Attempts(Identity(Task::kPosture, problem), 0);
  attempts.attempted = [this](int made) {
    if (settings_.progress) settings_.progress(made, method_.multi_starts + 1);
  };
  const MultiStartResult result =
      SolveWithRestarts(*solver_, *program, InitialGuess(dataset_, stance, initialization_), attempts);
  Account(result);
  outcome_.cost = result.best.value.cost;
  outcome_.waypoints = {result.x};
  outcome_.message = WorstTerm(*program, result.best);
  return Finish();
}

Eigen::VectorXd ProblemSolver::Run::WindowStart(std::span<const Stance> stances, bool fixed_first) const {
  const Eigen::Index size = dataset_.robot().configuration_size();
  const auto count = static_cast<Eigen::Index>(stances.size()) * kWaypointsPerStance;
  Eigen::VectorXd x(count * size);
  for (Eigen::Index t = 0; t < count; ++t) {
    x.segment(t * size, size) =
        InitialGuess(dataset_, stances[static_cast<size_t>(t / kWaypointsPerStance)], initialization_);
  }
  if (fixed_first) x.head(size) = outcome_.waypoints[outcome_.waypoints.size() - kWaypointsPerStance];
  return x;
}

void ProblemSolver::Run::KeepWindow(const MotionWindow& window, const Eigen::VectorXd& x) {
  const Eigen::Index size = dataset_.robot().configuration_size();
  outcome_.waypoints.resize(static_cast<size_t>(window.first_stance) * kWaypointsPerStance);
  for (Eigen::Index t = 0; t < x.size() / size; ++t) outcome_.waypoints.emplace_back(x.segment(t * size, size));
}

SolveOutcome ProblemSolver::Run::Motion(const ProblemDefinition& problem) {
  const std::vector<MotionWindow> windows = MotionWindows(static_cast<int>(problem.stances.size()));
  outcome_.windows = static_cast<int>(windows.size());
  for (const MotionWindow& window : windows) {
    const std::span<const Stance> stances =
        std::span(problem.stances)
            .subspan(static_cast<size_t>(window.first_stance), static_cast<size_t>(window.num_stances));
    const bool fixed_first = window.first_stance > 0;
    const auto program = WaypointProgram::Window(dataset_, query_, stances, Contacts(), fixed_first);
    const int index = outcome_.windows_solved;
    const size_t first_record = outcome_.history.size();
    const MultiStartResult result = SolveWithRestarts(
        *solver_, *program, WindowStart(stances, fixed_first),
        Attempts(Identity(Task::kMotion, problem) + std::to_string(index) + "/", fixed_first ? 1 : 0));
    for (size_t i = first_record; i < outcome_.history.size(); ++i) outcome_.history[i].window = index;
    Account(result);
    if (!result.best.feasible) {
      outcome_.message = "window " + std::to_string(index) + " of " + std::to_string(windows.size()) + " (stances " +
                         std::to_string(window.first_stance) + " to " +
                         std::to_string(window.first_stance + window.num_stances - 1) + "), " +
                         WorstTerm(*program, result.best);
      break;
    }
    KeepWindow(window, result.x);
    ++outcome_.windows_solved;
    if (settings_.progress) settings_.progress(outcome_.windows_solved, outcome_.windows);
    if (result.stopped()) break;
  }
  Eigen::VectorXd difference(dataset_.robot().tangent_size());
  for (size_t w = 1; w < outcome_.waypoints.size(); ++w) {
    ConfigurationDifference(dataset_.robot(), outcome_.waypoints[w - 1], outcome_.waypoints[w], difference);
    outcome_.cost += difference.squaredNorm();
  }
  return Finish();
}

ProblemSolver::ProblemSolver(std::shared_ptr<const Dataset> dataset, SolverRegistry registry)
    : dataset_(std::move(dataset)), registry_(std::move(registry)) {
  Query(SceneRepresentation::kSolid);
}

CollisionQuery& ProblemSolver::Query(SceneRepresentation representation) {
  std::unique_ptr<CollisionQuery>& query = queries_[static_cast<size_t>(representation)];
  if (query == nullptr) query = std::make_unique<CollisionQuery>(dataset_->collision_model(representation));
  return *query;
}

SolveOutcome ProblemSolver::Solve(Task task, int problem_id, Initialization initialization, const Method& method,
                                  const SolveSettings& settings) {
  return Solve(task, dataset_->problem(task, problem_id), initialization, method, settings);
}

SolveOutcome ProblemSolver::Solve(Task task, const ProblemDefinition& problem, Initialization initialization,
                                  const Method& method, const SolveSettings& settings) {
  Run run(*dataset_, Query(method.collision), initialization, method, settings, registry_);
  return task == Task::kPosture ? run.Posture(problem) : run.Motion(problem);
}

}  // namespace legopt
