#include "legopt/solvers/internal/best_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "legopt/math/random_numbers.h"
#include "legopt/problem/program.h"

namespace legopt {
namespace {

constexpr double kWidening = 0.2;        // relative growth of the noise with each start of a single waypoint
constexpr double kChainWidening = 0.25;  // growth of the noise with every second start of a chain's waypoint
constexpr double kNear = 0.8;            // largest change of a variable from one waypoint of a chain to the next
constexpr int kLinkPenalties = 3;        // penalty iterations of a waypoint of a chain
constexpr int kStepsBack = 4;            // a chain goes back by 1, 2, 4, 8 waypoints, and again
constexpr int kFirstChains = 4, kLastChains = 24;  // attempts to solve a window waypoint by waypoint
constexpr int kPatience = 5;                       // factor of waypoint_starts for the violated waypoints of a window
constexpr double kSteadyPenalty = 1e5;             // outweighs any decrease of the cost, at a typical violation
constexpr std::array kRelaxedShares = {0.5, 1.0};  // shares of the margins to relax; the rest helps to pass the judge
auto Part(const Program& program, Eigen::VectorXd& x, int waypoint) {
  const Eigen::Index size = program.point_size();
  return x.segment(waypoint * size, size);
}

bool Better(const SolverResult& a, const SolverResult& b) {
  if (a.feasible != b.feasible) return a.feasible;
  if (!a.value.IsFinite()) return false;
  return a.feasible ? a.value.Objective() < b.value.Objective() : a.value.max_violation < b.value.max_violation;
}

/// Options of a descent that starts at a feasible point and must stay feasible. With the usual first penalties, a
/// window whose waypoints were solved one by one becomes infeasible again.
SqpOptions Steady(SqpOptions options) {
  options.initial_penalty = std::max(options.initial_penalty, kSteadyPenalty);
  return options;
}

/// Options for several waypoints: reducing the cost of a window by the last few percent is not worth the time.
SqpOptions OfWindows(SqpOptions options, double improve_frac) {
  options.min_approx_improve_frac = improve_frac;
  return options;
}

/// Options of the short first descent with some terms disabled, which only produces an initial guess.
SqpOptions Free(SqpOptions options, int iterations) {
  options.max_iterations = std::max(iterations, 1);
  options.max_penalty_iterations = 1;
  return options;
}

/// Options of the waypoints of a chain: another start costs less than the last penalties of a failing descent.
SqpOptions OfLinks(SqpOptions options) {
  options.max_penalty_iterations = std::min(options.max_penalty_iterations, kLinkPenalties);
  return options;
}

/// Relaxes `share` of the margins of all terms. Returns whether any term has a margin.
bool RelaxMargin(const Program& program, double share) {
  bool any = false;
  for (const auto& term : program.terms()) any = term->RelaxMargin(share) || any;
  return any;
}

/// Records the change from `from` to `to` as one step if the solve has recorded no trial step.
void RecordMove(const SolverContext& context, size_t first_record, const ObjectiveValue& from,
                const ObjectiveValue& to) {
  if (NumRecords(context) > first_record) return;
  if (from.cost == to.cost && from.max_violation == to.max_violation) return;
  context.Record({.cost = to.cost, .violation = to.max_violation, .accepted = true});
}

}  // namespace

BestSolver::BestSolver(const BestOptions& options)
    : options_(options),
      waypoint_sqp_(options.sqp),
      window_sqp_(OfWindows(options.sqp, options.window_improve_frac)),
      steady_sqp_(Steady(options.sqp)),
      link_sqp_(OfLinks(options.sqp)),
      free_sqp_(Free(options.sqp, options.free_iterations)) {}

SolverResult BestSolver::Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) {
  start_ = x;
  waypoint_unsolved_ = false;
  is_window_ = program.num_waypoints() > 1 && LastWaypointIsFree(program, x);
  const size_t first_record = NumRecords(context);
  SolverResult best = Begin(program, context, x);
  const ObjectiveValue first = best.value;
  if (best.status == SolveStatus::kNumericalFailure && !best.value.IsFinite()) return best;
  if (options_.rescues > 0) Rescue(program, context, x, best);
  Refine(program, context, x, best);
  best.waypoint_unsolved = waypoint_unsolved_ && !best.feasible;
  RecordMove(context, first_record, first, best.value);
  CloseHistory(context, first_record, best.value);
  return best;
}

SqpSolver& BestSolver::SqpOf(const Program& program) {
  return program.num_waypoints() > 1 ? window_sqp_ : waypoint_sqp_;
}

SolverResult BestSolver::Begin(Program& program, const SolverContext& context, Eigen::VectorXd& x) {
  const size_t first_record = NumRecords(context);
  const SolverResult free = RunFirstDescent(program, context, x);
  had_first_descent_ = free.iterations > 0;
  SolverResult result = free;
  if (IsStopped(free.status)) {
    result.value = EvaluateObjective(program, x, scratch_);
    result.feasible = result.value.max_violation < options_.sqp.constraint_tolerance;
  } else {
    result = SqpOf(program).Solve(program, x, context);
    result.iterations += free.iterations;
  }
  if (had_first_descent_ && NumRecords(context) == first_record) {
    context.Record({.cost = result.value.cost, .violation = result.value.max_violation, .accepted = true});
  }
  return result;
}

bool BestSolver::LastWaypointIsFree(const Program& program, const Eigen::VectorXd& x) {
  const Eigen::Index size = static_cast<Eigen::Index>(program.num_waypoints()) * program.tangent_size();
  lower_.resize(size);
  upper_.resize(size);
  program.StepBounds(x, lower_, upper_);
  return (lower_.tail(program.tangent_size()).array() < upper_.tail(program.tangent_size()).array()).any();
}

SolverResult BestSolver::RunFirstDescent(Program& program, const SolverContext& context, Eigen::VectorXd& x) {
  SolverResult result;
  if (options_.free_iterations == 0 || !is_window_) return result;
  bool any = false;
  for (const auto& term : program.terms()) any = term->SetDisabled(true) || any;
  if (any) {
    SolverContext alone = context;
    alone.history = nullptr;  // its steps belong to a different program
    result = free_sqp_.Solve(program, x, alone);
  }
  for (const auto& term : program.terms()) term->SetDisabled(false);
  return result;
}

void BestSolver::Rescue(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best) {
  const auto goes_on = [&best] { return !best.feasible && !IsStopped(best.status); };
  if (had_first_descent_ && goes_on()) {
    trial_ = start_;
    Try(SqpOf(program), program, context, x, best);
  }
  const WaypointChains chains = options_.waypoint_chains;
  if (goes_on() && chains == WaypointChains::kFirst) RestartWithChain(program, context, kFirstChains, x, best);
  // A caller that plans a path between fixed end points can also use more pieces and move the end points.
  const int rescues = program.num_waypoints() == 1 || is_window_ ? options_.rescues : options_.rescues / 2;
  for (int k = 0; k < rescues && goes_on(); ++k) {
    const bool solved = PrepareRestart(program, context, k, x, best);
    if (goes_on()) TryRestart(program, context, solved, x, best);
  }
  if (goes_on()) RestartWithManyStarts(program, context, x, best);
  if (goes_on() && !waypoint_unsolved_ && chains != WaypointChains::kNever)
    RestartWithChain(program, context, kLastChains, x, best);
  if (goes_on()) RestartWithRelaxedMargins(program, context, x, best);
}

void BestSolver::Refine(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best) {
  if (program.num_waypoints() > 1 || !best.feasible) return;
  for (int k = 0; k < options_.refinements && !IsStopped(best.status); ++k) {
    Scatter(program, x, options_.refinement_noise, Noise::kBounded, context.rng(), trial_);
    Try(waypoint_sqp_, program, context, x, best);
  }
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
      dx_[i] = half_width * (2.0 * UniformRandom(generator) - 1.0);
    }
  }
  program.Retract(from, dx_, trial);
}

bool BestSolver::PrepareRestart(Program& program, const SolverContext& context, int k, const Eigen::VectorXd& x,
                                SolverResult& best) {
  constexpr int kOfWaypoints = 2;   // several waypoints: number of restarts that solve waypoints alone
  constexpr int kNearTheStart = 4;  // single waypoint: number of restarts with noise only, before the others
  const bool several = program.num_waypoints() > 1;
  const bool of_waypoints = options_.waypoint_starts > 0 && (several ? k < kOfWaypoints : k >= kNearTheStart);
  const Waypoints which = several && k == 0 ? Waypoints::kViolated : Waypoints::kAll;
  if (of_waypoints && SolveWaypoints(program, context, {which, options_.waypoint_starts}, x, best)) return true;
  Scatter(program, start_, options_.rescue_noise, Noise::kBounded, context.rng(), trial_);
  return false;
}

void BestSolver::TryRestart(Program& program, const SolverContext& context, bool solved, Eigen::VectorXd& x,
                            SolverResult& best) {
  if (solved) solved_ = trial_;
  Try(SqpOf(program), program, context, x, best);
  if (!solved || best.feasible || IsStopped(best.status)) return;
  // Constraints between two waypoints may still be violated.
  if (!(EvaluateObjective(program, solved_, scratch_).max_violation < options_.sqp.constraint_tolerance)) return;
  trial_ = solved_;
  Try(steady_sqp_, program, context, x, best);
}

void BestSolver::RestartWithManyStarts(Program& program, const SolverContext& context, Eigen::VectorXd& x,
                                       SolverResult& best) {
  if (!is_window_ || options_.waypoint_starts == 0) return;  // restarts of a single waypoint are already of this kind
  const WaypointSearch rescue{Waypoints::kViolated, kPatience * options_.waypoint_starts};
  const bool solved = SolveWaypoints(program, context, rescue, x, best);
  if (solved) TryRestart(program, context, true, x, best);
  waypoint_unsolved_ = !solved && !IsStopped(best.status);
}

void BestSolver::RestartWithChain(Program& program, const SolverContext& context, int attempts, Eigen::VectorXd& x,
                                  SolverResult& best) {
  if (!is_window_ || options_.waypoint_starts == 0) return;
  trial_ = start_;
  int from = 0;
  for (int k = 0; k < attempts && !IsStopped(best.status); ++k) {
    const ChainLinks links{.anew = k > 0, .near_only = 2 * k < attempts};
    const int solved = ExtendChain(program, context, from, links, best);
    if (solved == program.num_waypoints()) return TryRestart(program, context, true, x, best);
    from = std::max(0, solved - (1 << (k % kStepsBack)));
  }
}

int BestSolver::ExtendChain(Program& program, const SolverContext& context, int from, ChainLinks links,
                            SolverResult& best) {
  for (int t = from; t < program.num_waypoints(); ++t) {
    WaypointView view(program, t, trial_, ViewedTerms::kUpToWaypoint);
    if (view.terms().empty() || !view.IsFree()) continue;
    if (!SolveLink(view, context, t, links, best)) return t;
    links.anew = false;
    Part(program, trial_, t) = nearest_;
  }
  return program.num_waypoints();
}

bool BestSolver::SolveLink(WaypointView& view, const SolverContext& context, int waypoint, ChainLinks links,
                           SolverResult& best) {
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < options_.waypoint_starts && least > kNear; ++k) {
    SetChainStart(view, waypoint, links.anew ? k + 2 : k, context.rng());
    const bool solved = SolveView(link_sqp_, view, context, best);
    if (IsStopped(best.status)) return false;
    if (!solved) continue;
    const Eigen::Index size = view.point_size();
    const double change =
        waypoint == 0 ? 0.0 : (point_ - trial_.segment((waypoint - 1) * size, size)).cwiseAbs().maxCoeff();
    if (change >= least) continue;
    least = change;
    nearest_ = point_;
  }
  return least <= kNear || (!links.near_only && std::isfinite(least));
}

void BestSolver::SetChainStart(const WaypointView& view, int waypoint, int k, std::mt19937_64& generator) {
  const bool from_previous = waypoint > 0 && k % 2 == 0;
  const Eigen::Index size = view.point_size();
  const Eigen::VectorXd& of = from_previous ? trial_ : start_;
  point_ = of.segment((from_previous ? waypoint - 1 : waypoint) * size, size);
  if (k < 2) return;
  const int widenings = k / 2;
  const double near = kChainWidening * widenings, far = 1.0 + kWidening * widenings;
  const double half_width = options_.rescue_noise * (from_previous ? near : far);
  const Eigen::VectorXd centre = point_;
  Scatter(view, centre, half_width, Noise::kAll, generator, point_);
}

void BestSolver::RestartWithRelaxedMargins(Program& program, const SolverContext& context, Eigen::VectorXd& x,
                                           SolverResult& best) {
  for (const double share : kRelaxedShares) {
    if (!RelaxMargin(program, share)) return;
    for (const Waypoints which : {Waypoints::kViolated, Waypoints::kAll}) {
      if (best.feasible || IsStopped(best.status)) break;
      const bool solved = SolveWaypoints(program, context, {which, options_.waypoint_starts}, x, best);
      if (!solved) trial_ = x;
      if (!IsStopped(best.status)) TryRestart(program, context, solved, x, best);
      if (best.feasible) best.margin_relaxed = share;
    }
  }
  RelaxMargin(program, 0.0);
  if (!best.feasible) best.value = EvaluateObjective(program, x, scratch_);  // measured with the full margins
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

bool BestSolver::SolveWaypoints(Program& program, const SolverContext& context, const WaypointSearch& rescue,
                                const Eigen::VectorXd& x, SolverResult& best) {
  MeasureWaypoints(program, x);
  trial_ = x;
  const bool all = rescue.waypoints == Waypoints::kAll;
  for (int t = 0; t < program.num_waypoints(); ++t) {
    const bool violated = !(violation_[static_cast<size_t>(t)] <= options_.sqp.constraint_tolerance);
    if ((all || violated) && !SolveWaypoint(program, context, t, rescue.starts, best)) return false;
  }
  return true;
}

bool BestSolver::SolveWaypoint(Program& program, const SolverContext& context, int waypoint, int starts,
                               SolverResult& best) {
  WaypointView view(program, waypoint, trial_);
  if (view.terms().empty() || !view.IsFree()) return true;
  for (int k = 0; k < starts && !IsStopped(best.status); ++k) {
    SetWaypointStart(program, view, waypoint, k, context.rng());
    if (!SolveView(waypoint_sqp_, view, context, best)) continue;
    Part(program, trial_, waypoint) = point_;
    return true;
  }
  return false;
}

bool BestSolver::SolveView(SqpSolver& sqp, WaypointView& view, const SolverContext& context, SolverResult& best) {
  SolverContext alone = context;
  alone.history = nullptr;  // its steps are not steps of the whole program
  const SolverResult result = sqp.Solve(view, point_, alone);
  best += result;
  if (IsStopped(result.status)) best.status = result.status;
  return result.feasible && !IsStopped(result.status);
}

void BestSolver::SetWaypointStart(const Program& program, const WaypointView& view, int waypoint, int k,
                                  std::mt19937_64& generator) {
  const int neighbour = waypoint + (k == 1 ? -1 : 1);
  if (k == 0) {
    point_ = Part(program, trial_, waypoint);
  } else if (k <= 2 && neighbour >= 0 && neighbour < program.num_waypoints()) {
    point_ = Part(program, trial_, neighbour);
  } else {
    const double half_width = options_.rescue_noise * (1.0 + kWidening * (k % options_.waypoint_starts));
    Scatter(view, Part(program, start_, waypoint), half_width, Noise::kAll, generator, point_);
  }
}

void BestSolver::Try(SqpSolver& sqp, Program& program, const SolverContext& context, Eigen::VectorXd& x,
                     SolverResult& best) {
  SolverContext another = context;
  another.start = best.starts;
  SolverResult result = sqp.Solve(program, trial_, another);
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
