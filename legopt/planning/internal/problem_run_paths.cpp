#include <algorithm>
#include <map>
#include <set>

#include "legopt/planning/internal/problem_run.h"

namespace legopt {
namespace {

/// Least number of pieces per segment of a motion whose points are joined by a spline.
constexpr int kLeastPiecesOfCurve = 4;

}  // namespace

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
  paths_.emplace(dataset_, query_, *solver_, task_.task, OptionsOfPrograms());
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

}  // namespace legopt
