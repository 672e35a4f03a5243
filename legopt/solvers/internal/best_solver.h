#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "legopt/solvers/internal/sqp_solver.h"
#include "legopt/solvers/solver.h"
#include "legopt/solvers/sqp_options.h"

namespace legopt {

class WaypointView;

/// LegOpt-best: SQP with a wide trust box and internal restarts.
///
/// * First descent: for a window (several waypoints, the last one free), a few steps are made with collision terms
///   disabled (Term::SetDisabled). The SQP then starts near a motion that satisfies all other terms, whatever the
///   initial guess.
/// * Internal restarts, while the result is infeasible; the point of smallest violation is kept. For several waypoints,
///   the first one uses the initial guess without the first descent. The next two use waypoints that were solved
///   alone (program.h): first the violated ones, then all. The others add uniform noise to the bounded variables
///   (joints) of the initial guess. For a single waypoint, four noisy restarts are followed by restarts from points
///   that satisfy its constraints without costs, found by a search of growing radius. If all waypoints were solved
///   alone and the descent from there ends infeasible, it is repeated with a penalty that keeps it feasible. If all
///   restarts fail, the violated waypoints of a window are solved alone with many more starts. If each has a solution,
///   chains follow: waypoints solved one after the other with the terms between them (ViewedTerms::kUpToWaypoint). They
///   find what separate waypoints and small noise do not: waypoints that are all in one of several distant regions. The
///   last restarts relax half and then all of the terms' margins (Term::RelaxMargin), with two starts each: some narrow
///   places have no other solution.
/// * Refinement, for programs of one waypoint: restarts around the feasible solution, of which the cheapest feasible
///   result is kept. A posture has many local optima (arms, knees), and one solve takes about a millisecond.
///
/// It depends on terms only, like every solver. All random numbers come from the attempt's generator.
class BestSolver : public Solver {
 public:
  /// `options` must have passed Method::Validate.
  explicit BestSolver(const BestOptions& options);

  SolverResult Solve(Program& program, Eigen::VectorXd& x, const SolverContext& context) override;
  int max_backtracks() const override { return options_.window_backtracks; }

 private:
  /// Variables to which noise is added.
  enum class Noise {
    kBounded,  ///< variables with two finite bounds: the joints
    kAll       ///< all variables, including the base
  };

  /// Selection of the waypoints that are solved alone.
  enum class Waypoints {
    kViolated,  ///< waypoints that violate one of their own constraints
    kAll
  };

  /// Parameters of solving waypoints alone.
  struct WaypointSearch {
    Waypoints waypoints;
    int starts;  ///< maximum number of starts per waypoint
  };

  /// Demands on the waypoints of a chain.
  struct ChainLinks {
    bool anew = false;       ///< the first one starts from noise only
    bool near_only = false;  ///< each must be near the one before, so that the path between them is easy
  };

  /// Returns the SQP for descents of the whole program.
  SqpSolver& SqpOf(const Program& program);
  /// Runs the first start; a window continues from the end of RunFirstDescent().
  SolverResult Begin(Program& program, const SolverContext& context, Eigen::VectorXd& x);
  /// Returns whether the last waypoint can move.
  bool LastWaypointIsFree(const Program& program, const Eigen::VectorXd& x);
  /// Moves x of a window downhill with the terms that can be disabled turned off, if there are any. The returned value
  /// excludes these terms.
  SolverResult RunFirstDescent(Program& program, const SolverContext& context, Eigen::VectorXd& x);
  /// Runs internal restarts while no feasible point has been found.
  void Rescue(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// Runs restarts around a feasible point of a single waypoint.
  void Refine(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// Sets `trial` to `from` plus uniform noise.
  void Scatter(const Program& program, Eigen::Ref<const Eigen::VectorXd> from, double half_width, Noise noise,
               std::mt19937_64& generator, Eigen::VectorXd& trial);
  /// Sets trial_ to the start of internal restart `k`. Returns whether waypoints were solved alone for it.
  bool PrepareRestart(Program& program, const SolverContext& context, int k, const Eigen::VectorXd& x,
                      SolverResult& best);
  /// Tries trial_. If its waypoints were `solved` alone and the descent left its feasible point, tries it again with a
  /// high penalty.
  void TryRestart(Program& program, const SolverContext& context, bool solved, Eigen::VectorXd& x, SolverResult& best);
  /// Restarts a window with many starts for each violated waypoint.
  void RestartWithManyStarts(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);
  /// Restarts a window from waypoints that were solved one after the other, each from the one before and with the
  /// constraints between both. Where none is found, goes back by one waypoint, then by two, four, eight.
  void RestartWithChain(Program& program, const SolverContext& context, int attempts, Eigen::VectorXd& x,
                        SolverResult& best);
  /// Solves the waypoints of trial_ from `from` on, one after the other. Returns the first one that was not solved, or
  /// the number of waypoints.
  int ExtendChain(Program& program, const SolverContext& context, int from, ChainLinks links, SolverResult& best);
  /// Sets nearest_ to a solution of a waypoint of the chain near the one before, or to the nearest that was found.
  /// Returns whether there is one.
  bool SolveLink(WaypointView& view, const SolverContext& context, int waypoint, ChainLinks links, SolverResult& best);
  /// Sets point_ to start `k` of a waypoint of the chain: the previous one, its own initial guess, then noise of
  /// growing width around both in turn.
  void SetChainStart(const WaypointView& view, int waypoint, int k, std::mt19937_64& generator);
  /// Runs the last restarts, with the terms' margins relaxed.
  void RestartWithRelaxedMargins(Program& program, const SolverContext& context, Eigen::VectorXd& x,
                                 SolverResult& best);
  /// Stores the violation of each waypoint's own constraints at x in violation_.
  void MeasureWaypoints(Program& program, const Eigen::VectorXd& x);
  /// Sets trial_ to x with the selected waypoints solved alone. Returns false if a waypoint was not solved or the stop
  /// check ended the search.
  bool SolveWaypoints(Program& program, const SolverContext& context, const WaypointSearch& rescue,
                      const Eigen::VectorXd& x, SolverResult& best);
  /// Solves one waypoint of trial_ alone, with at most `starts` starts. Returns whether it is solved.
  bool SolveWaypoint(Program& program, const SolverContext& context, int waypoint, int starts, SolverResult& best);
  /// Solves a view from point_, adds the effort to `best`, and sets its status after a stop. Returns whether point_ is
  /// feasible.
  bool SolveView(SqpSolver& sqp, WaypointView& view, const SolverContext& context, SolverResult& best);
  /// Sets point_ to start `k` of a waypoint that is solved alone: its current value, those of its neighbours, then
  /// noise of growing width around its initial guess.
  void SetWaypointStart(const Program& program, const WaypointView& view, int waypoint, int k,
                        std::mt19937_64& generator);
  /// Solves from trial_ and keeps the result in x if it is better.
  void Try(SqpSolver& sqp, Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);

  BestOptions options_;
  SqpSolver waypoint_sqp_, window_sqp_, steady_sqp_, link_sqp_, free_sqp_;
  Eigen::VectorXd start_, trial_, solved_, point_, nearest_, dx_, lower_, upper_;
  bool is_window_ = false;  ///< several waypoints, the last one free; false for segments between fixed end points
  bool had_first_descent_ = false;
  bool waypoint_unsolved_ = false;  ///< a waypoint was not solved even alone
  std::vector<double> violation_;   ///< one entry per waypoint
  std::vector<double> scratch_;
};

}  // namespace legopt
