#include "legopt/solve/path_solver.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "legopt/evaluate/foot_pose_error.h"
#include "legopt/robot/interpolation.h"
#include "legopt/terms/task_program.h"

namespace legopt {
namespace {

/// What planted feet may leave their targets by between points: a good part of what the judge allows, as points have
/// errors of their own.
constexpr double kDrift = 1.2e-3;
/// Aimed at by the first choice of pieces.
constexpr double kAimedDrift = 0.7e-3;
/// Longest way of a point of the robot from one sample of a piece to the next, m.
constexpr double kSweepStep_m = 0.02;
/// Of it, with each further try.
constexpr double kFinerStep = 0.5;
/// Added to the margin in further tries: the solver's tolerance would leave nothing of it between points.
constexpr double kWiderMargin_m = 3e-4;
/// Tries of a way, and which one of them begins from the straight way again.
constexpr int kMostTries = 8;
constexpr int kFreshTry = 5;

}  // namespace

PathSolver::PathSolver(const Dataset& dataset, CollisionQuery& query, Solver& solver, Task task,
                       const ContactOptions& contacts)
    : dataset_(&dataset),
      query_(&query),
      solver_(&solver),
      task_(task),
      contacts_(contacts),
      clearance_(dataset.robot(), query, contacts.range_m),
      kinematics_(dataset.robot()),
      x_(dataset.robot().configuration_size()) {}

std::int64_t PathSolver::Evaluations() const {
  return evaluations_ + (program_ == nullptr ? 0 : program_->TermEvaluations());
}

/// Largest pose error of planted feet between the points, where it is largest: in the middle of each piece.
double PathSolver::Drift(const Stance& planted, const Eigen::VectorXd& points) {
  const Eigen::Index size = dataset_->robot().configuration_size();
  double largest = 0.0;
  for (Eigen::Index i = 0; i + size < points.size(); i += size) {
    InterpolateConfiguration(dataset_->robot(), points.segment(i, size), points.segment(i + size, size), 0.5, x_);
    kinematics_.UpdatePoses(x_);
    for (const Foothold& foothold : planted.footholds) {
      const Eigen::Isometry3d& pose = kinematics_.link_pose(dataset_->foot(foothold.link).link_index);
      largest = std::max(largest, ErrorOfFootPose(dataset_->FootTarget(foothold), pose).violation);
    }
  }
  return largest;
}

/// What the program's points do not tell.
bool PathSolver::WillDo(const Stance& planted, const Eigen::VectorXd& points, WaySolution* solution) {
  if (Drift(planted, points) > kDrift) {
    solution->message = "planted feet drift between the points";
    return false;
  }
  if (IsFree(points)) return true;
  const auto name = [this](int link) { return dataset_->robot().links()[static_cast<std::size_t>(link)].name; };
  const Contact& obstacle = clearance_.obstacle();
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

int PathSolver::FirstPieces(const Stance& planted, const Eigen::VectorXd& ends) {
  const double drift = Drift(planted, ends);
  if (drift <= kDrift) return 1;
  return std::min(kMostPieces, static_cast<int>(std::ceil(std::sqrt(drift / kAimedDrift))));
}

/// The same way in `pieces` pieces of equal time.
Eigen::VectorXd PathSolver::Divided(const Eigen::VectorXd& points, int pieces) const {
  const Eigen::Index size = dataset_->robot().configuration_size();
  const int before = static_cast<int>(points.size() / size) - 1;
  Eigen::VectorXd divided((pieces + 1) * size);
  for (int k = 0; k <= pieces; ++k) {
    const double at = static_cast<double>(k) * before / pieces;
    const int piece = std::min(static_cast<int>(at), before - 1);
    InterpolateConfiguration(dataset_->robot(), points.segment(piece * size, size),
                             points.segment((piece + 1) * size, size), at - piece, divided.segment(k * size, size));
  }
  divided.head(size) = points.head(size);
  divided.tail(size) = points.tail(size);
  return divided;
}

bool PathSolver::SolvePieces(const MultiStartSettings& attempts, Program& program, Eigen::VectorXd& points,
                             WaySolution* solution) {
  program_ = &program;
  const MultiStartResult result = SolveWithRestarts(*solver_, program, points, attempts);
  evaluations_ = Evaluations();
  program_ = nullptr;
  points = result.x;
  solution->restarts += result.restarts;
  solution->effort += result.effort;
  solution->status = result.best.status;
  solution->max_violation = result.best.value.max_violation;
  solution->message = result.best.feasible ? "" : WorstTerm(program, result.best);
  return result.best.feasible;
}

WaySolution PathSolver::Solve(const Way& way, const std::function<MultiStartSettings()>& attempts) {
  const Stance planted = PlantedFeet(*way.from_stance, *way.to_stance);
  const bool balanced = DescriptionOf(task_).between == Between::kBalanced;
  const Eigen::Index size = dataset_->robot().configuration_size();
  Eigen::VectorXd points(2 * size);
  points << *way.from, *way.to;
  WaySolution solution;
  if (balanced && planted.footholds.empty()) {
    solution.message = "no foot stays planted to be balanced on";
    return solution;
  }
  int pieces = FirstPieces(planted, points);
  solution.feasible = pieces == 1 && IsFree(points);
  pieces = std::max(pieces, 2);
  Sweep sweep = Sweep::kWithScene;
  double step_m = kSweepStep_m;
  ContactOptions contacts = contacts_;
  const Eigen::VectorXd straight = points;
  for (int k = 0; k < kMostTries && !solution.feasible && !IsStopped(solution.status); ++k) {
    points = Divided(k == kFreshTry ? straight : points, pieces);
    const auto program = MakePathProgram(*dataset_, *query_, planted, pieces, balanced, contacts, step_m, sweep);
    solution.feasible = SolvePieces(attempts(), *program, points, &solution) && WillDo(planted, points, &solution);
    pieces = std::min(kMostPieces, 2 * pieces);
    step_m *= kFinerStep;
    contacts.margin_m = std::min(contacts_.margin_m + kWiderMargin_m, 0.5 * (contacts_.margin_m + contacts_.range_m));
    sweep = Sweep::kWithAll;
  }
  for (Eigen::Index i = size; i + size < points.size(); i += size) solution.inner.emplace_back(points.segment(i, size));
  return solution;
}

}  // namespace legopt
