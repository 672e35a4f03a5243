#include "legopt/planning/internal/path_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "legopt/dataset/contact.h"
#include "legopt/judge/internal/diagnostic.h"
#include "legopt/problem/terms/task_program.h"
#include "legopt/robot/configuration.h"
#include "legopt/statics/equilibrium_polygon.h"

namespace legopt {
namespace {

/// Maximum number of levels: the smallest intervals are 1 / 1024 of a piece.
constexpr std::size_t kMaxLevels = 12;

}  // namespace

PathClearance::PathClearance(const RobotModel& robot, CollisionQuery& query, double range_m)
    : robot_(&robot), query_(&query), range_m_(range_m), pair_index_(robot.links().size() * robot.links().size(), -1) {
  int index = 0;
  for (const auto& [first, second] : query.model().checked_pairs()) {
    pair_index_[static_cast<std::size_t>(first) * robot.links().size() + static_cast<std::size_t>(second)] = index++;
  }
}

PathClearance::Sample& PathClearance::Level(std::size_t level) {
  while (levels_.size() <= level) levels_.emplace_back(*robot_);
  return levels_[level];
}

void PathClearance::Place(double s, Sample* sample) {
  InterpolateConfiguration(from_, to_, s, x_);
  sample->kinematics.UpdatePoses(x_);
  sample->scene_m.assign(robot_->links().size(), range_m_);
  sample->pairs_m.assign(query_->model().checked_pairs().size(), range_m_);
  sample->nearest = {};
  sample->nearest.distance_m = range_m_;
  for (const ProximityPair& contact : query_->Contacts(sample->kinematics, range_m_, &memory_)) {
    const auto first = static_cast<std::size_t>(contact.link_a);
    double* distance_m = &sample->scene_m[first];
    if (contact.link_b != kScene) {
      const int pair = pair_index_[first * robot_->links().size() + static_cast<std::size_t>(contact.link_b)];
      distance_m = &sample->pairs_m[static_cast<std::size_t>(pair)];
    }
    *distance_m = std::min(*distance_m, contact.distance_m);
    if (contact.distance_m < sample->nearest.distance_m) sample->nearest = contact;
  }
}

bool PathClearance::IsFreeAt(const Sample& sample) {
  if (sample.nearest.distance_m >= kClearance_m) return true;
  obstacle_ = sample.nearest;
  return false;
}

bool PathClearance::Excluded(const Sample& a, const Sample& b) const {
  const auto excluded = [](double d_a, double d_b, double segment) {
    return 0.5 * (d_a + d_b - segment) >= kClearance_m;
  };
  const CollisionModel& model = query_->model();
  for (std::size_t link = 0; link < a.scene_m.size(); ++link) {
    const CollisionModel::Ball& ball = model.link_ball(static_cast<int>(link));
    if (ball.radius < 0.0) continue;
    const double segment = MaxDisplacement(ball, a.kinematics.link_pose(static_cast<int>(link)),
                                           b.kinematics.link_pose(static_cast<int>(link)));
    if (!excluded(a.scene_m[link], b.scene_m[link], segment)) return false;
  }
  for (std::size_t i = 0; i < a.pairs_m.size(); ++i) {
    const auto& [first, second] = model.checked_pairs()[i];
    const auto relative = [first = first, second = second](const Sample& sample) {
      return sample.kinematics.link_pose(first).inverse(Eigen::Isometry) * sample.kinematics.link_pose(second);
    };
    const double segment = MaxDisplacement(model.link_ball(second), relative(a), relative(b));
    if (!excluded(a.pairs_m[i], b.pairs_m[i], segment)) return false;
  }
  return true;
}

bool PathClearance::Bisect(std::size_t level, double s_a, const Sample& a, double s_b, const Sample& b) {
  if (level >= kMaxLevels) return true;
  if (turn_ * (s_b - s_a) <= kLargestTurn && Excluded(a, b)) return true;
  const double s = 0.5 * (s_a + s_b);
  Sample& middle = Level(level);
  Place(s, &middle);
  return IsFreeAt(middle) && Bisect(level + 1, s_a, a, s, middle) && Bisect(level + 1, s, middle, s_b, b);
}

bool PathClearance::IsFree(Eigen::Ref<const Eigen::VectorXd> from, Eigen::Ref<const Eigen::VectorXd> to) {
  from_ = from;
  to_ = to;
  x_.resize(from.size());
  const auto start = PartsOf(from_), end = PartsOf(to_);
  const double half = std::min(
      1.0, std::abs(start.quaternion_coefficients().normalized().dot(end.quaternion_coefficients().normalized())));
  const double joints = start.num_joints() == 0 ? 0.0 : (end.joints() - start.joints()).cwiseAbs().maxCoeff();
  turn_ = std::max(joints, 2.0 * std::acos(half));
  Sample& a = Level(0);
  Sample& b = Level(1);
  Place(0.0, &a);
  Place(1.0, &b);
  return IsFreeAt(a) && IsFreeAt(b) && Bisect(2, 0.0, a, 1.0, b);
}

namespace {

/// Largest drift of planted feet from their targets between points: a large part of the judge's tolerance, because the
/// points have errors of their own.
constexpr double kMaxDrift = 1.2e-3;
/// Largest distance of the centre of mass from the support polygon of the planted feet between points, m.
constexpr double kMaxComDeviation_m = 1.5e-3;
/// Drift at which the first number of pieces aims.
constexpr double kTargetDrift = 0.7e-3;
/// Longest displacement of a point of the robot between two samples of a piece, m.
constexpr double kSweepStep_m = 0.02;
/// Factor of that step with each further try.
constexpr double kFinerStep = 0.5;
/// Added to the margin in further tries: the solver's tolerance would use up the margin between points.
constexpr double kWiderMargin_m = 3e-4;
constexpr int kMaxTries = 4;
/// Minimum number of pieces per segment of a path with several segments.
constexpr int kMinPiecesOfSeveral = 4;

/// Returns the largest number of pieces of a segment. Long programs of paths that a spline joins would take minutes.
int MostPieces(Task task, std::size_t num_segments) {
  return HasTimeLaw(task) && num_segments > 1 ? kPiecesToDivide : kMaxPieces;
}

}  // namespace

PathSolver::PathSolver(const Dataset& dataset, CollisionQuery& query, Solver& solver, Task task,
                       const ProgramOptions& proximity)
    : dataset_(&dataset),
      query_(&query),
      solver_(&solver),
      task_(task),
      proximity_(proximity),
      clearance_(dataset.robot(), query, proximity.range_m),
      kinematics_(dataset.robot()),
      x_(dataset.robot().configuration_size()) {}

std::int64_t PathSolver::Evaluations() const {
  return evaluations_ + (program_ == nullptr ? 0 : program_->TermEvaluations());
}

std::int64_t PathSolver::Work_ns() const { return work_ns_ + (program_ == nullptr ? 0 : program_->TermWork_ns()); }

/// Calls visit(segment) with kinematics_ at the middle of each piece, where a path deviates most from the
/// constraints at its points.
template <class Visit>
void PathSolver::ForEachMiddle(const Eigen::VectorXd& points, Visit visit) {
  const Eigen::Index size = dataset_->robot().configuration_size();
  const Eigen::Index pieces = points.size() / size - 1, pieces_of_way = pieces / std::ssize(planted_);
  for (Eigen::Index k = 0; k < pieces; ++k) {
    InterpolateConfiguration(points.segment(k * size, size), points.segment((k + 1) * size, size), 0.5, x_);
    kinematics_.Update(x_);
    visit(static_cast<std::size_t>(k / pieces_of_way));
  }
}

/// Returns the largest pose error of planted feet between the points.
double PathSolver::Drift(const Eigen::VectorXd& points) {
  double largest = 0.0;
  ForEachMiddle(points, [&](std::size_t way) {
    for (const ContactTarget& target : planted_[way].contacts) {
      const Contact& contact = dataset_->contact(target.contact);
      const Eigen::Isometry3d& pose = kinematics_.link_pose(contact.link_index);
      largest = std::max(largest, ComputeContactPoseError(contact, target, pose).violation);
    }
  });
  return largest;
}

/// Returns the largest distance of the centre of mass outside the support polygon of the planted feet between the
/// points; 0 if balance is not required.
double PathSolver::ComDeviation(const Eigen::VectorXd& points) {
  double largest = 0.0;
  if (!IsBalanced(task_)) return largest;
  ForEachMiddle(points, [&](std::size_t way) {
    if (planted_[way].contacts.empty()) return;
    if (polygons_[way].empty()) {
      largest = std::numeric_limits<double>::infinity();
      return;
    }
    largest = std::max(largest, SignedDistanceToPolygon(polygons_[way], kinematics_.com().head<2>()));
  });
  return largest;
}

/// Checks the path between the points: drift, balance and collisions. Returns whether it is acceptable; if not, sets
/// the message.
bool PathSolver::IsAcceptable(const Eigen::VectorXd& points, PathSolution* solution) {
  if (Drift(points) > kMaxDrift) {
    solution->message = "planted feet drift between the points";
    return false;
  }
  if (ComDeviation(points) > kMaxComDeviation_m) {
    solution->message = "the centre of mass leaves the planted feet between the points";
    return false;
  }
  if (IsFree(points)) return true;
  const auto name = [this](int link) { return dataset_->robot().links()[static_cast<std::size_t>(link)].name; };
  const ProximityPair& obstacle = clearance_.obstacle();
  solution->message = name(obstacle.link_a) + " collides between the points with " +
                      (obstacle.link_b == kScene ? "the scene" : name(obstacle.link_b));
  return false;
}

bool PathSolver::IsFree(const Eigen::VectorXd& points) {
  const Eigen::Index size = dataset_->robot().configuration_size();
  for (Eigen::Index i = 0; i + size < points.size(); i += size) {
    if (!clearance_.IsFree(points.segment(i, size), points.segment(i + size, size))) return false;
  }
  return true;
}

/// Returns the number of pieces per segment for the first try; 1 if the straight segment may be acceptable as it is.
int PathSolver::InitialPieces(const WaypointPath& start, const Eigen::VectorXd& ends, int least_pieces) {
  if (start.num_segments() > 1 || least_pieces > 1) {
    int most = start.num_segments() > 1 ? std::max(least_pieces, kMinPiecesOfSeveral) : least_pieces;
    for (const auto& way : start.ways) most = std::max(most, static_cast<int>(way.size()) + 1);
    return std::min(MostPieces(task_, start.num_segments()), most);
  }
  const double drift = Drift(ends);
  if (drift <= kMaxDrift && ComDeviation(ends) <= kMaxComDeviation_m) return 1;
  return std::clamp(static_cast<int>(std::ceil(std::sqrt(drift / kTargetDrift))), 2, kMaxPieces);
}

/// Returns the same path, divided into `pieces` pieces of equal time.
Eigen::VectorXd PathSolver::Subdivided(const Eigen::VectorXd& points, int pieces) const {
  const Eigen::Index size = dataset_->robot().configuration_size();
  const int before = static_cast<int>(points.size() / size) - 1;
  Eigen::VectorXd divided((pieces + 1) * size);
  for (int k = 0; k <= pieces; ++k) {
    const double at = static_cast<double>(k) * before / pieces;
    const int piece = std::min(static_cast<int>(at), before - 1);
    InterpolateConfiguration(points.segment(piece * size, size), points.segment((piece + 1) * size, size), at - piece,
                             divided.segment(k * size, size));
  }
  divided.head(size) = points.head(size);
  divided.tail(size) = points.tail(size);
  return divided;
}

/// Returns all points of a path, with `pieces` pieces per segment.
Eigen::VectorXd PathSolver::PointsOf(const WaypointPath& waypoint_path, int pieces) const {
  const Eigen::Index size = dataset_->robot().configuration_size();
  const Eigen::Index way_size = pieces * size;
  Eigen::VectorXd points(static_cast<Eigen::Index>(waypoint_path.num_segments()) * way_size + size);
  for (std::size_t w = 0; w < waypoint_path.num_segments(); ++w) {
    const std::vector<Eigen::VectorXd>& inner = waypoint_path.ways[w];
    Eigen::VectorXd way((std::ssize(inner) + 2) * size);
    way.head(size) = waypoint_path.waypoints[w];
    for (Eigen::Index k = 0; k < std::ssize(inner); ++k) {
      way.segment((k + 1) * size, size) = inner[static_cast<std::size_t>(k)];
    }
    way.tail(size) = waypoint_path.waypoints[w + 1];
    points.segment(static_cast<Eigen::Index>(w) * way_size, way_size + size) = Subdivided(way, pieces);
  }
  return points;
}

/// Returns the path with these points, the inverse of PointsOf.
WaypointPath PathSolver::PathThroughPoints(const WaypointPath& start, const Eigen::VectorXd& points) const {
  const Eigen::Index size = dataset_->robot().configuration_size();
  const auto ways = static_cast<Eigen::Index>(start.num_segments());
  const Eigen::Index pieces = (points.size() / size - 1) / ways;
  WaypointPath waypoint_path = start;
  for (Eigen::Index w = 0; w < ways; ++w) {
    std::vector<Eigen::VectorXd>& inner = waypoint_path.ways[static_cast<std::size_t>(w)];
    inner.clear();
    for (Eigen::Index k = 1; k < pieces; ++k) inner.emplace_back(points.segment((w * pieces + k) * size, size));
    waypoint_path.waypoints[static_cast<std::size_t>(w)] = points.segment(w * pieces * size, size);
  }
  waypoint_path.waypoints.back() = points.tail(size);
  return waypoint_path;
}

void PathSolver::Bind(std::span<const Stance* const> stances) {
  planted_.clear();
  polygons_.clear();
  for (std::size_t w = 0; w + 1 < stances.size(); ++w) {
    planted_.push_back(PlantedContacts(*dataset_, *stances[w], *stances[w + 1]));
    polygons_.emplace_back();
    if (!planted_.back().contacts.empty()) polygons_.back() = BalancePolygon(*dataset_, planted_.back());
  }
}

bool PathSolver::SolvePieces(const MultiStartSettings& attempts, Program& program, Eigen::VectorXd& points,
                             PathSolution* solution) {
  program_ = &program;
  const MultiStartResult result = SolveWithRestarts(*solver_, program, points, attempts);
  evaluations_ = Evaluations();
  work_ns_ = Work_ns();
  program_ = nullptr;
  points = result.x;
  solution->restarts += result.restarts;
  solution->effort += result.effort;
  solution->status = result.best.status;
  solution->max_violation = result.best.value.max_violation;
  solution->margin_relaxed = result.best.margin_relaxed;
  solution->message = result.best.feasible ? "" : WorstTerm(WorstTermName(program, result.best));
  return result.best.feasible;
}

std::string PathSolver::FaultOf(std::span<const Eigen::VectorXd> samples) {
  const Eigen::Index size = dataset_->robot().configuration_size();
  Eigen::VectorXd points(std::ssize(samples) * size);
  for (Eigen::Index i = 0; i < std::ssize(samples); ++i) {
    points.segment(i * size, size) = samples[static_cast<std::size_t>(i)];
  }
  PathSolution found;
  return IsAcceptable(points, &found) ? "" : found.message;
}

PathSolution PathSolver::Solve(const WaypointPath& start, const std::function<MultiStartSettings()>& attempts,
                               int least_pieces) {
  const bool balanced = IsBalanced(task_);
  Bind(start.stances);
  PathSolution solution;
  solution.waypoint_path = start;
  for (const Stance& planted : planted_) {
    if (!balanced || !planted.contacts.empty()) continue;
    solution.message = "no foot stays planted to be balanced on";
    return solution;
  }
  Eigen::VectorXd points = PointsOf(start, 1);
  int pieces = InitialPieces(start, points, least_pieces);
  solution.feasible = pieces == 1 && IsFree(points);
  pieces = std::max(pieces, 2);
  Sweep sweep = Sweep::kWithScene;
  double step_m = kSweepStep_m;
  ProgramOptions proximity = proximity_;
  for (int k = 0; k < kMaxTries && !solution.feasible && !IsStopped(solution.status); ++k) {
    points = k == 0 ? PointsOf(start, pieces) : Subdivided(points, pieces * static_cast<int>(start.num_segments()));
    const auto program =
        MakePathProgram(*dataset_, *query_, start.stances, start.ends, pieces, balanced, proximity, step_m, sweep);
    solution.feasible = SolvePieces(attempts(), *program, points, &solution) && IsAcceptable(points, &solution);
    pieces = std::min(MostPieces(task_, start.num_segments()), 2 * pieces);
    step_m *= kFinerStep;
    proximity.margin_m =
        std::min(proximity_.margin_m + kWiderMargin_m, 0.5 * (proximity_.margin_m + proximity_.range_m));
    sweep = Sweep::kWithAll;
  }
  solution.waypoint_path = PathThroughPoints(start, points);
  return solution;
}

}  // namespace legopt
