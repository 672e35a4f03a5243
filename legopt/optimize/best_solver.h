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
/// * Of several waypoints with a free end, a few first steps are made without the terms that can be set aside, the
///   collisions (Term::SetAside). What follows begins near a motion that meets all else, wherever the start was.
/// * Rescue: while the result is infeasible, another start. Of several waypoints, the original one without those first
///   steps; then two that are made of waypoints solved alone (waypoint_view.h): those that are violated, then all.
///   Others are the original start with uniform noise on the bounded variables (the joints); of a single waypoint,
///   after four of these, places that meet its constraints without the costs, searched from ever farther away. Where
///   all waypoints were solved and the descent from there still ends elsewhere, another one sets out with a penalty
///   that keeps it feasible. The smallest violation is kept. When all have failed, violated waypoints get many more
///   starts (of a free end); and the last rescues, two and two, spend half and then all of what the terms keep in
///   reserve (Term::SpendReserve): there are places with no other way through.
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

  /// Which waypoints are solved alone.
  enum class Waypoints {
    kViolated,  ///< those that violate a constraint of their own
    kAll
  };

  /// How waypoints are solved alone.
  struct WaypointRescue {
    Waypoints waypoints;  ///< which
    int starts;           ///< of each, at most
  };

  /// For descents of all of the program.
  SqpSolver& SqpOf(const Program& program);
  /// The first start, of a window from the end of a free descent.
  SolverResult Begin(Program& program, const SolverContext& context, Eigen::VectorXd& x);
  /// Whether the last waypoint may move.
  bool EndsFreely(const Program& program, const Eigen::VectorXd& x);
  /// Of a window: moves x down without the terms that can be set aside, if there are any. Its
  /// value is that of the others.
  SolverResult DescendFreely(Program& program, const SolverContext& context, Eigen::VectorXd& x);
  /// Further starts while nothing feasible has been found.
  void Rescue(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// Further starts around a feasible waypoint.
  void Refine(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// `from` with noise into trial.
  void Scatter(const Program& program, Eigen::Ref<const Eigen::VectorXd> from, double half_width, Noise noise,
               std::mt19937_64& generator, Eigen::VectorXd& trial);
  /// Puts the start of rescue `k` into trial_. True when it is made of waypoints that were solved alone.
  bool StartRescue(Program& program, const SolverContext& context, int k, const Eigen::VectorXd& x, SolverResult& best);
  /// Tries trial_; from a point `solved` by waypoints once more, steadily, when it was feasible and the descent left
  /// that.
  void TryRescue(Program& program, const SolverContext& context, bool solved, Eigen::VectorXd& x, SolverResult& best);
  /// A rescue of a window whose violated ones are given many starts.
  void RescueWithPatience(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// The last rescues, without the terms' reserve.
  void RescueWithoutReserve(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// Violation of each waypoint by itself at x.
  void MeasureWaypoints(Program& program, const Eigen::VectorXd& x);
  /// x with waypoints solved alone, into trial_. False when one of them has not been solved, or a stop check ended it.
  bool SolveWaypoints(Program& program, const SolverContext& context, const WaypointRescue& rescue,
                      const Eigen::VectorXd& x, SolverResult& best);
  /// The same for one waypoint of trial_, with so many starts at most.
  bool SolveWaypoint(Program& program, const SolverContext& context, int waypoint, int starts, SolverResult& best);
  /// Start k of a waypoint alone, into point_: where it is, where its neighbours are, then ever further around where
  /// it began.
  void PlaceWaypoint(const Program& program, const WaypointView& view, int waypoint, int k, std::mt19937_64& generator);
  /// Solves from trial_ and keeps its end in x when it is better.
  void Try(SqpSolver& sqp, Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);

  BestOptions options_;
  SqpSolver waypoint_sqp_, window_sqp_, steady_sqp_, free_sqp_;
  Eigen::VectorXd start_, trial_, solved_, point_, dx_, lower_, upper_;
  bool is_window_ = false;  ///< several waypoints with a free end; what is held at both ends is a way that others found
  bool began_freely_ = false;
  std::vector<double> violation_;  ///< by waypoint
  std::vector<double> scratch_;
};

}  // namespace legopt
