#include "legopt/optimize/best_solver.h"

#include <algorithm>
#include <cmath>

#include "legopt/program/waypoint_view.h"
#include "legopt/random_draws.h"

namespace legopt {
namespace {

constexpr double kWidening = 0.2;  // of the noise, with each start of a waypoint alone

/// The part of x that belongs to a waypoint.
auto Part(const Program& program, Eigen::VectorXd& x, int waypoint) {
  const Eigen::Index size = program.point_size();
  return x.segment(waypoint * size, size);
}

bool Better(const SolverResult& a, const SolverResult& b) {
  if (a.feasible != b.feasible) return a.feasible;
  if (!a.value.IsFinite()) return false;
  return a.feasible ? a.value.Objective() < b.value.Objective() : a.value.max_violation < b.value.max_violation;
}

/// A better start from where no step was worth a try is a step of its own.
void RecordMove(const SolverContext& context, size_t first_record, const ObjectiveValue& from,
                const ObjectiveValue& to) {
  if (NumRecords(context) > first_record) return;
  if (from.cost == to.cost && from.max_violation == to.max_violation) return;
  context.Record({.cost = to.cost, .violation = to.max_violation, .accepted = true});
}

}  // namespace

BestSolver::BestSolver(const BestOptions& options) : options_(options), sqp_(options.sqp), waypoint_sqp_(options.sqp) {}

SolverResult BestSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  start_ = x;
  const size_t first_record = NumRecords(context);
  SolverResult best = sqp_.Solve(program, x, context);
  const ObjectiveValue first = best.value;
  if (best.status == SolveStatus::kNumericalFailure && !best.value.IsFinite()) return best;
  for (int k = 0; k < options_.rescues && !best.feasible && !IsStopped(best.status); ++k) {
    StartRescue(program, context, k, x, best);
    if (IsStopped(best.status)) break;
    Try(program, context, x, best);
  }
  if (options_.rescues > 0 && !best.feasible && !IsStopped(best.status)) {
    RescueWithoutReserve(program, context, x, best);
  }
  const int refinements = program.num_waypoints() == 1 && best.feasible ? options_.refinements : 0;
  for (int k = 0; k < refinements && !IsStopped(best.status); ++k) {
    Scatter(program, x, options_.refinement_noise, Noise::kBounded, context.Draws(), trial_);
    Try(program, context, x, best);
  }
  RecordMove(context, first_record, first, best.value);
  CloseHistory(context, first_record, best.value);
  return best;
}

void BestSolver::Scatter(const Program& program, Eigen::Ref<const Eigen::VectorXd> from, double half_width, Noise noise,
                         std::mt19937_64& generator, Eigen::VectorXd& trial) {
  const Eigen::Index size = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  dx_.setZero(size);
  lower_.resize(size);
  upper_.resize(size);
  trial.resize(from.size());
  program.StepBounds(from, lower_, upper_);
  for (Eigen::Index i = 0; i < size; ++i) {
    const bool bounded = std::isfinite(lower_[i]) && std::isfinite(upper_[i]);
    if ((bounded || noise == Noise::kAll) && lower_[i] < upper_[i]) {
      dx_[i] = half_width * (2.0 * UniformDraw(generator) - 1.0);
    }
  }
  program.Retract(from, dx_, trial);
}

void BestSolver::StartRescue(Program& program, const SolverContext& context, int k, const Eigen::VectorXd& x,
                             SolverResult& best) {
  constexpr int kOfWaypoints = 2;   // of several: the first rescues
  constexpr int kNearTheStart = 4;  // of one: these come before
  const bool several = program.num_waypoints() > 1;
  const bool of_waypoints = options_.waypoint_starts > 0 && (several ? k < kOfWaypoints : k >= kNearTheStart);
  if (of_waypoints && SolveWaypoints(program, context, !several || k > 0, x, best)) return;
  Scatter(program, start_, options_.rescue_noise, Noise::kBounded, context.Draws(), trial_);
}

void BestSolver::RescueWithoutReserve(Program& program, const SolverContext& context, Eigen::VectorXd& x,
                                      SolverResult& best) {
  bool any = false;
  for (const auto& term : program.terms()) any = term->SpendReserve(true) || any;
  for (const bool all : {false, true}) {
    if (!any || best.feasible || IsStopped(best.status)) break;
    if (!SolveWaypoints(program, context, all, x, best)) trial_ = x;
    if (!IsStopped(best.status)) Try(program, context, x, best);
  }
  for (const auto& term : program.terms()) term->SpendReserve(false);
}

void BestSolver::MeasureWaypoints(Program& program, const Eigen::VectorXd& x) {
  violation_.assign(static_cast<size_t>(program.num_waypoints()), 0.0);
  program.SetPoint(x);
  for (const auto& term : program.terms()) {
    const TermShape& shape = term->shape();
    if (shape.num_waypoints > 1) continue;
    scratch_.clear();
    term->Evaluate(scratch_);
    ObjectiveValue value;
    value.Add(shape, 0, scratch_);
    double& violation = violation_[static_cast<size_t>(shape.waypoint)];
    violation = std::max(violation, value.max_violation);
  }
}

bool BestSolver::SolveWaypoints(Program& program, const SolverContext& context, bool all, const Eigen::VectorXd& x,
                                SolverResult& best) {
  MeasureWaypoints(program, x);
  trial_ = x;
  for (int t = 0; t < program.num_waypoints(); ++t) {
    const bool violated = !(violation_[static_cast<size_t>(t)] <= options_.sqp.constraint_tolerance);
    if ((all || violated) && !SolveWaypoint(program, context, t, best)) return false;
  }
  return true;
}

bool BestSolver::SolveWaypoint(Program& program, const SolverContext& context, int waypoint, SolverResult& best) {
  WaypointView view(program, waypoint, trial_);
  if (view.terms().empty() || !view.IsFree()) return true;
  SolverContext alone = context;
  alone.history = nullptr;  // its steps are not steps of the whole point
  for (int k = 0; k < options_.waypoint_starts; ++k) {
    PlaceWaypoint(program, view, waypoint, k, context.Draws());
    const SolverResult result = waypoint_sqp_.Solve(view, point_, alone);
    best += result;
    if (IsStopped(result.status)) {
      best.status = result.status;
      return false;
    }
    if (result.feasible) {
      Part(program, trial_, waypoint) = point_;
      return true;
    }
  }
  return false;
}

void BestSolver::PlaceWaypoint(const Program& program, const WaypointView& view, int waypoint, int k,
                               std::mt19937_64& generator) {
  const int neighbour = waypoint + (k == 1 ? -1 : 1);
  if (k == 0) {
    point_ = Part(program, trial_, waypoint);
  } else if (k <= 2 && neighbour >= 0 && neighbour < program.num_waypoints()) {
    point_ = Part(program, trial_, neighbour);
  } else {
    const double half_width = options_.rescue_noise * (1.0 + kWidening * k);
    Scatter(view, Part(program, start_, waypoint), half_width, Noise::kAll, generator, point_);
  }
}

void BestSolver::Try(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best) {
  SolverContext another = context;
  another.start = best.starts;
  SolverResult result = sqp_.Solve(program, trial_, another);
  Effort effort = best;
  effort += result;
  const SolveStatus status = result.status;
  if (Better(result, best)) {
    best = result;
    x.swap(trial_);
  }
  if (IsStopped(status)) best.status = status;
  static_cast<Effort&>(best) = effort;
}

}  // namespace legopt
