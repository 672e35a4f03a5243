#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "legopt/planning/internal/curve_faults.h"
#include "legopt/planning/internal/multi_start.h"
#include "legopt/planning/internal/path_solver.h"
#include "legopt/planning/internal/solve_timer.h"
#include "legopt/planning/problem_solver.h"
#include "legopt/problem/terms/task_program.h"

namespace legopt {

/// Points of a program that a restart does not perturb.
enum class Ends : std::uint8_t {
  kFree,        ///< none
  kFirstFixed,  ///< the first
  kBothFixed    ///< the first and the last
};

/// State of one solve: first windows, one after the other (problem_run.cpp), then the paths between their waypoints
/// (problem_run_paths.cpp). The functions are described where they are defined.
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

  /// Solves the problem. Must be called once.
  SolveOutcome Solve(const ProblemDefinition& problem);

 private:
  /// Returns everything that determines the random numbers of a window's attempts. It is the same on every machine
  /// and for every method, so that methods get the same noise and their results are paired.
  std::string Identity(const ProblemDefinition& problem, int window) const {
    return std::to_string(settings_.experiment_seed) + "/" + std::string(ToString(task_.task)) + "/" +
           std::to_string(problem.id) + "/" + std::string(ToString(initialization_)) + "/" +
           std::to_string(settings_.repetition) + "/" + (task_.windowed ? std::to_string(window) + "/" : "");
  }
  /// Returns the options of all programs of this solve.
  ProgramOptions OptionsOfPrograms() const;
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

  // Windows.
  /// Result of one window.
  struct WindowResult {
    StanceWindow window;        ///< stances of the program that was solved
    MultiStartResult attempts;  ///< result of all its attempts
    std::string worst_term;     ///< term with the largest violation; empty if feasible
  };
  /// Accuracy of one window's point.
  struct WindowAccuracy {
    int first_stance = 0;
    double max_violation = 0.0;
    double margin_relaxed = 0.0;
  };
  Eigen::VectorXd WindowStart(const StanceWindow& window, std::span<const Stance> stances) const;
  WindowResult SolveStances(const ProblemDefinition& problem, const StanceWindow& window, int index,
                            const std::string& identity, int first_restart);
  void Backtrack(const ProblemDefinition& problem, int index, WindowResult* result);
  bool SolveWindow(const ProblemDefinition& problem, const StanceWindow& window, int index);
  void SolveSegments(const ProblemDefinition& problem);
  void KeepWindow(const StanceWindow& window, const Eigen::VectorXd& x);
  void KeepUnsolved(const StanceWindow& window, const Eigen::VectorXd& x);
  std::string WindowName(const StanceWindow& window, int index) const;
  void Account(const WindowResult& result);

  // Paths between the waypoints.
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
  std::vector<WindowAccuracy> accuracies_;              ///< one entry per window whose waypoints are kept
  double window_costs_ = 0.0;                           ///< sum of the programs' own costs
  std::optional<PathSolver> paths_;                     ///< used by continuous tasks once the waypoints are known
  std::vector<std::vector<Eigen::VectorXd>> segments_;  ///< points between the waypoints of a continuous task
};

}  // namespace legopt
