#include "legopt/planning/problem_solver.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "legopt/judge/internal/path_examiner.h"
#include "legopt/math/blake2b.h"
#include "legopt/planning/internal/curve_faults.h"
#include "legopt/planning/internal/multi_start.h"
#include "legopt/planning/internal/path_solver.h"
#include "legopt/planning/internal/solve_timer.h"
#include "legopt/problem/terms/initial_guess.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/types/number_text.h"

namespace legopt {
namespace {

constexpr double kRadiansPerDegree = M_PI / 180.0;
/// Least number of pieces per segment of a motion whose points are joined by a spline.
constexpr int kLeastPiecesOfCurve = 4;
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

/// Points of a program that a restart does not perturb.
enum class Ends : std::uint8_t {
  kFree,        ///< none
  kFirstFixed,  ///< the first
  kBothFixed    ///< the first and the last
};

/// State of one solve.
class ProblemSolver::Run {
 public:
  Run(const Dataset& dataset, CollisionQuery& query, Task task, Initialization initialization, const Method& method,
      const SolveSettings& settings, const SolverRegistry& registry)
      : dataset_(dataset),
        query_(query),
        first_query_(query.queries()),
        task_(DescriptionOf(task)),
        initialization_(initialization),
        method_(method),
        settings_(settings),
        solver_(MakeSolver(method, registry)) {}

  SolveOutcome Solve(const ProblemDefinition& problem);

 private:
  /// Returns everything that determines the random numbers of a window's attempts. It is the same on every machine
  /// and for every method, so that methods get the same noise and their results are paired.
  std::string Identity(const ProblemDefinition& problem, int window) const {
    return std::to_string(settings_.experiment_seed) + "/" + std::string(ToString(task_.task)) + "/" +
           std::to_string(problem.id) + "/" + std::string(ToString(initialization_)) + "/" +
           std::to_string(settings_.repetition) + "/" + (task_.windowed ? std::to_string(window) + "/" : "");
  }
  ProgramOptions Contacts() const {
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
  /// Returns the number of term evaluations so far.
  std::int64_t Evaluations() const {
    return outcome_.term_evaluations + (program_ == nullptr ? 0 : program_->TermEvaluations()) +
           (paths_ ? paths_->Evaluations() : 0);
  }
  /// Returns the weighted sum of these evaluations.
  std::int64_t Work_ns() const {
    return outcome_.work_ns + (program_ == nullptr ? 0 : program_->TermWork_ns()) + (paths_ ? paths_->Work_ns() : 0);
  }
  std::optional<SolveStatus> Stopped() const;
  void Perturb(std::mt19937_64& generator, Ends ends, Eigen::VectorXd& x) const;
  MultiStartSettings Attempts(std::string identity, int window, Ends ends);
  /// Result of one window.
  struct WindowResult {
    StanceWindow window;        ///< stances of the program that was solved
    MultiStartResult attempts;  ///< result of all its attempts
    std::string worst_term;     ///< term with the largest violation; empty if feasible
  };
  Eigen::VectorXd WindowStart(const StanceWindow& window, std::span<const Stance> stances) const;
  WindowResult SolveStances(const ProblemDefinition& problem, const StanceWindow& window, int index,
                            const std::string& identity);
  void Backtrack(const ProblemDefinition& problem, int index, WindowResult* result);
  bool SolveWindow(const ProblemDefinition& problem, const StanceWindow& window, int index);
  void SolveSegments(const ProblemDefinition& problem);
  void KeepWindow(const StanceWindow& window, const Eigen::VectorXd& x);
  void KeepUnsolved(const StanceWindow& window, const Eigen::VectorXd& x);
  std::string WindowName(const StanceWindow& window, int index) const;
  void Account(const MultiStartResult& result);
  WaypointPath CurrentPath(const ProblemDefinition& problem, int first, int last) const;
  void Keep(const WaypointPath& waypoint_path, int first);
  bool SolvePath(const ProblemDefinition& problem, int way, int first, int last, PathSolution* solution,
                 int least_pieces);
  bool SolvePath(const std::string& identity, const WaypointPath& start, int least_pieces, PathSolution* solution,
                 bool restarts);
  TimedPath RefineCurve(const ProblemDefinition& problem);
  bool SolveSegmentsAtFault(const ProblemDefinition& problem, std::span<const Stance* const> stances);
  void DividePiecesAtFault(const ProblemDefinition& problem, std::span<const Stance* const> stances, TimedPath* path);
  bool SolveFiner(const ProblemDefinition& problem, int segment);
  bool DividePiece(const ProblemDefinition& problem, const CurveFault& fault, TimedPath* path);
  int SolveSegment(const ProblemDefinition& problem, int way);
  void Account(const PathSolution& solution, int way);
  const Stance* StanceAt(const ProblemDefinition& problem, int waypoint) const {
    return &problem.stances[static_cast<size_t>(StanceOfWaypoint(task_.task, waypoint))];
  }
  SolveOutcome Finish();

  const Dataset& dataset_;
  CollisionQuery& query_;
  std::int64_t first_query_;  ///< number of queries answered before this solve
  const TaskDescription& task_;
  Initialization initialization_;
  const Method& method_;
  const SolveSettings& settings_;
  std::unique_ptr<Solver> solver_;
  SolveTimer timer_;
  SolveOutcome outcome_;
  const Program* program_ = nullptr;                    ///< program of the current window
  double window_costs_ = 0.0;                           ///< sum of the programs' own costs
  std::optional<PathSolver> paths_;                     ///< used by continuous tasks once the waypoints are known
  std::vector<std::vector<Eigen::VectorXd>> segments_;  ///< points between the waypoints of a continuous task
};

// The effort limit is checked first: a solve that reaches it ends there, unless the clock stopped it earlier.
std::optional<SolveStatus> ProblemSolver::Run::Stopped() const {
  constexpr double kMicros = 1e6;
  if (settings_.cancelled && settings_.cancelled()) return SolveStatus::kCancelled;
  if (settings_.effort_limit > 0 && Evaluations() >= settings_.effort_limit) return SolveStatus::kEffortLimit;
  const bool late = static_cast<double>(timer_.wall_us()) > settings_.wall_limit_s * kMicros;
  return late ? std::optional(SolveStatus::kTimeLimit) : std::nullopt;
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

/// Returns the current path from one waypoint to another.
WaypointPath ProblemSolver::Run::CurrentPath(const ProblemDefinition& problem, int first, int last) const {
  WaypointPath waypoint_path;
  for (int w = first; w <= last; ++w) {
    waypoint_path.stances.push_back(StanceAt(problem, w));
    waypoint_path.waypoints.push_back(outcome_.waypoints[static_cast<size_t>(w)]);
    if (w < last) waypoint_path.ways.push_back(segments_[static_cast<size_t>(w)]);
  }
  if (last - first > 1) waypoint_path.ends = {first == 0, last + 1 == std::ssize(outcome_.waypoints)};
  return waypoint_path;
}

void ProblemSolver::Run::Keep(const WaypointPath& waypoint_path, int first) {
  std::copy(waypoint_path.waypoints.begin(), waypoint_path.waypoints.end(), outcome_.waypoints.begin() + first);
  std::copy(waypoint_path.ways.begin(), waypoint_path.ways.end(), segments_.begin() + first);
}

/// Solves for the path between two waypoints that contains segment `way`. Returns false if there is no solution.
bool ProblemSolver::Run::SolvePath(const ProblemDefinition& problem, int way, int first, int last,
                                   PathSolution* solution, int least_pieces) {
  const std::string identity =
      Identity(problem, outcome_.windows + way) + (last - first > 1 ? std::to_string(last - first) + "/" : "");
  // With several segments, restarts of a long program would take minutes and solve little.
  const bool restarts = !HasTimeLaw(task_.task) || last - first == 1;
  return SolvePath(identity, CurrentPath(problem, first, last), least_pieces, solution, restarts);
}

/// Solves for a path from its current points. `identity` determines the noise of restarts. Returns false if there is no
/// solution.
bool ProblemSolver::Run::SolvePath(const std::string& identity, const WaypointPath& start, int least_pieces,
                                   PathSolution* solution, bool restarts) {
  const auto attempts = [&] {
    MultiStartSettings settings = Attempts(identity, outcome_.windows, Ends::kBothFixed);
    if (!restarts) settings.max_restarts = 0;
    return settings;
  };
  *solution = paths_->Solve(start, attempts, least_pieces);
  outcome_.restarts += solution->restarts;
  outcome_ += solution->effort;
  if (solution->feasible) outcome_.margin_relaxed = std::max(outcome_.margin_relaxed, solution->margin_relaxed);
  return solution->feasible;
}

/// Solves for the segment from one waypoint to the next. If there is no solution, neighbouring waypoints move as well:
/// first its own, then more and more on either side. Returns the next segment to solve. A failed segment is also kept,
/// so that the judge reports it.
int ProblemSolver::Run::SolveSegment(const ProblemDefinition& problem, int way) {
  const int most_beside = HasTimeLaw(task_.task) ? 2 : 4;  // a spline needs more pieces, and so more time
  const int last = static_cast<int>(outcome_.waypoints.size()) - 1;
  PathSolution solution, wider;
  const int least_pieces = HasTimeLaw(task_.task) ? kLeastPiecesOfCurve : 1;
  bool solved = SolvePath(problem, way, way, way + 1, &solution, least_pieces);
  int end = way + 1;
  WaypointPath found = solution.waypoint_path;
  int first = way;
  for (int beside = 1; beside <= most_beside && !solved && !IsStopped(solution.status); ++beside) {
    const int from = std::max(0, way - beside), to = std::min(last, way + 1 + beside);
    if (to - from <= end - first) break;  // the whole motion
    solved = SolvePath(problem, way, from, to, &wider, least_pieces);
    if (IsStopped(wider.status)) solution.status = wider.status;
    if (!solved) continue;
    found = wider.waypoint_path;
    first = from;
    end = to;
    solution = wider;
  }
  Keep(found, first);
  Account(solution, way);
  return end;
}

/// Solves for all segments between the waypoints of a continuous task, one after the other.
void ProblemSolver::Run::SolveSegments(const ProblemDefinition& problem) {
  paths_.emplace(dataset_, query_, *solver_, task_.task, Contacts());
  const int num_segments = static_cast<int>(outcome_.waypoints.size()) - 1;
  segments_.assign(static_cast<size_t>(std::max(num_segments, 0)), {});
  const bool complete = outcome_.windows_solved == outcome_.windows;
  for (int way = 0; complete && way < num_segments;) {
    if (const auto stop = Stopped()) {
      outcome_.status = *stop;
      break;
    }
    way = SolveSegment(problem, way);
  }
  const bool refined = complete && HasTimeLaw(task_.task) && outcome_.status == SolveStatus::kConvergedFeasible;
  const TimedPath path = refined ? RefineCurve(problem) : MakePath(outcome_.waypoints, segments_);
  outcome_.term_evaluations = Evaluations();
  outcome_.work_ns = Work_ns();
  paths_.reset();
  outcome_.waypoints = FormatPath(path);
}

/// Adds points where the spline through all points breaks a rule, until it does not.
TimedPath ProblemSolver::Run::RefineCurve(const ProblemDefinition& problem) {
  std::vector<const Stance*> stances;
  for (int w = 0; w < std::ssize(outcome_.waypoints); ++w) stances.push_back(StanceAt(problem, w));
  const bool solved = SolveSegmentsAtFault(problem, stances);
  TimedPath path = MakePath(outcome_.waypoints, segments_);
  if (solved) DividePiecesAtFault(problem, stances, &path);
  return path;
}

/// Solves segments on which the spline breaks a rule again, with twice the pieces. If the most pieces do not suffice,
/// the segment is left with kPiecesToDivide. Returns false if a segment has no solution.
bool ProblemSolver::Run::SolveSegmentsAtFault(const ProblemDefinition& problem,
                                              std::span<const Stance* const> stances) {
  std::map<size_t, std::vector<Eigen::VectorXd>> to_divide;  // inner points
  for (bool changed = true; changed;) {
    changed = false;
    const TimedPath path = MakePath(outcome_.waypoints, segments_);
    std::set<size_t> at_fault;
    for (const CurveFault& fault : FindCurveFaults(dataset_.robot(), *paths_, path, stances)) {
      at_fault.insert(fault.segment);
    }
    for (const size_t segment : at_fault) {
      std::vector<Eigen::VectorXd>& inner = segments_[segment];
      const auto kept = to_divide.find(segment);
      if (inner.size() + 1 >= kMaxPieces) {
        if (kept == to_divide.end()) continue;
        inner = kept->second;
      } else {
        if (kept != to_divide.end()) continue;
        if (inner.size() + 1 == kPiecesToDivide) to_divide[segment] = inner;
        if (!SolveFiner(problem, static_cast<int>(segment))) return false;
      }
      changed = true;
    }
  }
  return true;
}

/// Divides the pieces on which the spline breaks a rule, until none does or no more can be divided. Where the direction
/// changes at a waypoint, the curve then stays near the straight pieces, which satisfy all rules; but it turns sharply,
/// which takes time.
void ProblemSolver::Run::DividePiecesAtFault(const ProblemDefinition& problem, std::span<const Stance* const> stances,
                                             TimedPath* path) {
  std::vector<CurveFault> faults;
  for (bool divided = true; divided;) {
    divided = false;
    faults = FindCurveFaults(dataset_.robot(), *paths_, *path, stances);
    // From the end, so that the indices before stay.
    for (auto fault = faults.rbegin(); fault != faults.rend() && !Stopped(); ++fault) {
      if (DividePiece(problem, *fault, path)) divided = true;
    }
  }
  for (const CurveFault& fault : faults) {
    PathSolution failed;
    failed.status = Stopped().value_or(failed.status);
    failed.message = "the curve through the points fails: " + fault.message;
    Account(failed, static_cast<int>(fault.segment));
  }
}

/// Solves one segment again, with twice the pieces. Returns false if there is no solution.
bool ProblemSolver::Run::SolveFiner(const ProblemDefinition& problem, int segment) {
  const int pieces = static_cast<int>(segments_[static_cast<size_t>(segment)].size()) + 1;
  PathSolution solution;
  SolvePath(problem, segment, segment, segment + 1, &solution, 2 * pieces);
  Keep(solution.waypoint_path, segment);
  Account(solution, segment);
  return solution.feasible;
}

/// Divides one piece by a point that satisfies all rules. Returns false if there is none, or no more are permitted.
bool ProblemSolver::Run::DividePiece(const ProblemDefinition& problem, const CurveFault& fault, TimedPath* path) {
  const int segment = static_cast<int>(fault.segment);
  const size_t pieces = path->waypoints[fault.segment + 1] - path->waypoints[fault.segment];
  if (pieces >= kMaxPieces) return false;
  const WaypointPath piece{.stances = {StanceAt(problem, segment), StanceAt(problem, segment + 1)},
                           .waypoints = {path->points[fault.piece], path->points[fault.piece + 1]},
                           .ways = {{}}};
  const std::string identity = Identity(problem, outcome_.windows + segment) + std::to_string(fault.piece) + "/";
  PathSolution solution;
  if (!SolvePath(identity, piece, 2, &solution, true)) return false;
  const std::vector<Eigen::VectorXd>& inner = solution.waypoint_path.ways.front();
  if (pieces + inner.size() > kMaxPieces) return false;
  InsertPoints(fault.piece, inner, path);
  return true;
}

void ProblemSolver::Run::Account(const PathSolution& solution, int way) {
  if (!solution.feasible && outcome_.message.empty()) {
    outcome_.message = "from waypoint " + std::to_string(way) + " to the next, " + solution.message;
    outcome_.status =
        solution.status == SolveStatus::kConvergedFeasible ? SolveStatus::kConvergedInfeasible : solution.status;
  }
  if (IsStopped(solution.status)) outcome_.status = solution.status;
  outcome_.max_violation = std::max(outcome_.max_violation, solution.max_violation);
}

void ProblemSolver::Run::Account(const MultiStartResult& result) {
  outcome_.restarts += result.restarts;
  outcome_ += result.effort;
  // Several windows: status of the first that did not converge, or of the one that ended the solve.
  const bool converged = outcome_.status == SolveStatus::kNotRun || outcome_.status == SolveStatus::kConvergedFeasible;
  if (converged || !result.best.feasible || result.stopped()) outcome_.status = result.best.status;
  outcome_.budget_spent = result.best.budget_spent;
  outcome_.max_violation = std::max(outcome_.max_violation, result.best.value.max_violation);
  outcome_.margin_relaxed = std::max(outcome_.margin_relaxed, result.best.margin_relaxed);
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

/// Solves the program of a window's stances. `identity` determines the noise of restarts.
ProblemSolver::Run::WindowResult ProblemSolver::Run::SolveStances(const ProblemDefinition& problem,
                                                                  const StanceWindow& window, int index,
                                                                  const std::string& identity) {
  const std::span<const Stance> stances =
      std::span(problem.stances)
          .subspan(static_cast<size_t>(window.first_stance), static_cast<size_t>(window.num_stances));
  const bool fixed_first = window.first_stance > 0;
  const auto program = MakeTaskProgram(task_.task, dataset_, query_, stances, Contacts(), fixed_first);
  program_ = program.get();
  WindowResult result{.window = window, .attempts = {}, .worst_term = {}};
  result.attempts = SolveWithRestarts(*solver_, *program, WindowStart(window, stances),
                                      Attempts(identity, index, fixed_first ? Ends::kFirstFixed : Ends::kFree));
  outcome_.term_evaluations = Evaluations();
  outcome_.work_ns = Work_ns();
  program_ = nullptr;
  result.worst_term = WorstTermName(*program, result.attempts.best);
  return result;
}

/// Solves a window without a solution together with earlier stances, which may have led into a dead end. Replaces
/// `result` if that succeeds or is stopped; adds the effort otherwise.
void ProblemSolver::Run::Backtrack(const ProblemDefinition& problem, int index, WindowResult* result) {
  const StanceWindow window = result->window;
  const SolverContext all{{}, nullptr, &outcome_.history, Attempts("", index, Ends::kFree).stamp};
  for (int k = 1; k <= solver_->max_backtracks(); ++k) {
    const int back = std::min(k * kStancesBack, window.first_stance);
    const SolverResult& best = result->attempts.best;
    if (back <= (k - 1) * kStancesBack || best.feasible || best.waypoint_unsolved || IsStopped(best.status)) return;
    const StanceWindow wider{window.first_stance - back, window.num_stances + back};
    const size_t first_record = NumRecords(all);
    WindowResult another =
        SolveStances(problem, wider, index, Identity(problem, index) + "back/" + std::to_string(k) + "/");
    if (another.attempts.best.feasible || another.attempts.stopped()) std::swap(*result, another);
    result->attempts.effort += another.attempts.effort;
    result->attempts.restarts += another.attempts.restarts;
    CloseHistory(all, first_record, result->attempts.best.value);
  }
}

/// Solves one window. Returns false if the window failed or was stopped, which ends the problem. The best point is kept
/// even if it is infeasible; for windows, apart from the waypoints of the solved windows.
bool ProblemSolver::Run::SolveWindow(const ProblemDefinition& problem, const StanceWindow& window, int index) {
  WindowResult result = SolveStances(problem, window, index, Identity(problem, index));
  Backtrack(problem, index, &result);
  Account(result.attempts);
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

ProblemSolver::ProblemSolver(std::shared_ptr<const Dataset> dataset, SolverRegistry registry)
    : dataset_(std::move(dataset)), registry_(std::move(registry)) {
  Query(SceneRepresentation::kSolid, PairSelection::kReference);
}

CollisionQuery& ProblemSolver::Query(SceneRepresentation representation, PairSelection pairs) {
  std::unique_ptr<CollisionQuery>& query = queries_[representation][pairs];
  if (query == nullptr) query = std::make_unique<CollisionQuery>(dataset_->collision_model(representation, pairs));
  return *query;
}

SolveOutcome ProblemSolver::Solve(Task task, int problem_id, Initialization initialization, const Method& method,
                                  const SolveSettings& settings) {
  return Solve(task, dataset_->problem(task, problem_id), initialization, method, settings);
}

SolveOutcome ProblemSolver::Solve(Task task, const ProblemDefinition& problem, Initialization initialization,
                                  const Method& method, const SolveSettings& settings) {
  return Run(*dataset_, Query(method.collision, method.pairs), task, initialization, method, settings, registry_)
      .Solve(problem);
}

}  // namespace legopt
