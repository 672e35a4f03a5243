#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "legopt/optimize/best_options.h"
#include "legopt/optimize/solver.h"
#include "legopt/optimize/sqp_solver.h"

namespace legopt {

class WaypointView;

/// LegOpt-best: SQP with a wide trust box, started again where one start is not enough.
///
/// * Rescue: while the result is infeasible, another start. Of several waypoints, the first two are made of waypoints
///   that were solved alone (waypoint_view.h): those that are violated, then all. Others are the original start with
///   uniform noise on the bounded variables (the joints); of a single waypoint, after four of these, places that meet
///   its constraints without the costs, searched from ever farther away. The smallest violation is kept. When all of
///   them have failed, two more spend what the terms keep in reserve (Term::SpendReserve): there are places with no
///   other way through.
/// * Refinement, for programs of one waypoint: starts around the feasible solution, of which the cheapest feasible end
///   is kept. A posture has many local optima (arms, knees), and one solve costs about a millisecond.
///
/// It knows terms, like every solver; random draws come from the attempt's generator.
class BestSolver : public Solver {
 public:
  /// Options as checked by Method::Validate; not looked at again.
  explicit BestSolver(const BestOptions& options);

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;

 private:
  /// What noise moves.
  enum class Noise {
    kBounded,  ///< variables with two finite bounds: the joints
    kAll       ///< the base, too
  };

  /// `from` with noise into trial.
  void Scatter(const Program& program, Eigen::Ref<const Eigen::VectorXd> from, double half_width, Noise noise,
               std::mt19937_64& generator, Eigen::VectorXd& trial);
  /// Puts the start of rescue `k` into trial_.
  void StartRescue(Program& program, const SolverContext& context, int k, const Eigen::VectorXd& x, SolverResult& best);
  /// The last rescues, without the terms' reserve.
  void RescueWithoutReserve(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// Violation of each waypoint by itself at x.
  void MeasureWaypoints(Program& program, const Eigen::VectorXd& x);
  /// x with waypoints solved alone, into trial_: those that are violated, or all. False when one of them has not been
  /// solved, or a stop check ended it.
  bool SolveWaypoints(Program& program, const SolverContext& context, bool all, const Eigen::VectorXd& x,
                      SolverResult& best);
  /// The same for one waypoint of trial_.
  bool SolveWaypoint(Program& program, const SolverContext& context, int waypoint, SolverResult& best);
  /// Start k of a waypoint alone, into point_: where it is, where its neighbours are, then ever further around where
  /// it began.
  void PlaceWaypoint(const Program& program, const WaypointView& view, int waypoint, int k, std::mt19937_64& generator);
  /// Solves from trial_ and keeps its end in x when it is better.
  void Try(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);

  BestOptions options_;
  SqpSolver sqp_, waypoint_sqp_;
  Eigen::VectorXd start_, trial_, point_, dx_, lower_, upper_;
  std::vector<double> violation_;  ///< by waypoint
  std::vector<double> scratch_;
};

}  // namespace legopt
