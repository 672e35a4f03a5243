#pragma once

#include <Eigen/Core>
#include <random>

#include "legopt/optimize/best_options.h"
#include "legopt/optimize/solver.h"
#include "legopt/optimize/sqp_solver.h"

namespace legopt {

/// LegOpt-best: SQP with a wide trust box, started again where one start is not enough.
///
/// * Rescue: while the result is infeasible, another start, the original one with uniform noise on the bounded
///   variables (the joints). The smallest violation is kept.
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
  /// `from` with noise on every variable that has two finite bounds.
  void Scatter(const Program& program, const Eigen::VectorXd& from, double noise, std::mt19937_64& generator);
  /// Solves from trial_ and keeps its end in x when it is better.
  void Try(Program& program, const SolverContext& context, Eigen::VectorXd& x, SolverResult& best);

  BestOptions options_;
  SqpSolver sqp_;
  Eigen::VectorXd start_, trial_, dx_, lower_, upper_;
};

}  // namespace legopt
