#pragma once

#include "legopt/solvers/sqp_options.h"

namespace legopt {

/// Options of LegOpt-best. The defaults of the trust region differ from TrajOpt's: a wide box, gentle shrinking and
/// early convergence halve the number of iterations and give better optima.
struct BestOptions {
  /// Returns SqpOptions with the defaults of LegOpt-best.
  static SqpOptions WideSqp() {
    SqpOptions sqp;
    sqp.trust_box_size = 2.0;
    sqp.trust_shrink_ratio = 0.3;
    sqp.trust_expand_ratio = 2.0;
    sqp.improve_ratio_threshold = 0.1;
    sqp.min_approx_improve_frac = 0.03;
    sqp.trust_rule = TrustRule::kMeasured;
    sqp.polish_violations = false;
    sqp.subproblem_accuracy_frac = 1e-3;
    sqp.subproblem_decrease_share = 0.995;
    sqp.constraint_tolerance = 4e-4;
    return sqp;
  }

  SqpOptions sqp = WideSqp();
  /// Number of SQP iterations of the first descent of a window (several waypoints, the last one free), in which terms
  /// that can be disabled (collisions) are off. >= 0; 0: no such descent.
  int free_iterations = 3;
  double window_improve_frac = 0.15;  ///< min_approx_improve_frac for programs of several waypoints, >= 0
  /// Maximum number of internal restarts while no feasible point has been found, >= 0. Chains fixed at both ends get
  /// half as many.
  int rescues = 8;
  double rescue_noise = 0.15;  ///< half width of the uniform noise on bounded variables; rad, m; > 0
  /// Maximum number of starts when a waypoint is solved alone, without costs. >= 0; 0: waypoints are never solved
  /// alone. With several waypoints, the first of the `rescues` solves the violated waypoints alone, the second one all
  /// waypoints. With a single waypoint, the fifth and later ones begin at such a solution.
  int waypoint_starts = 20;
  int refinements = 0;  ///< starts around the feasible solution, to lower its cost; single waypoints only, >= 0
  double refinement_noise = 0.5;  ///< half width of the noise of refinements; rad, m; > 0

  /// Visits the fields under their keys in `options:`, including those of the trust region (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    constexpr int kMaxStarts = 1000;
    constexpr double kMinNoise = 1e-6;
    constexpr double kMaxNoise = 10.0;
    constexpr double kAlwaysWritten = 0.0;
    SqpOptions::Visit(options.sqp, fields, kAlwaysWritten);
    fields.Integer("free_iterations", options.free_iterations, 0, kMaxStarts);
    fields.Number("window_improve_frac", options.window_improve_frac, 0.0, 1.0);
    fields.Integer("rescues", options.rescues, 0, kMaxStarts);
    fields.Number("rescue_noise", options.rescue_noise, kMinNoise, kMaxNoise);
    fields.Integer("waypoint_starts", options.waypoint_starts, 0, kMaxStarts);
    fields.Integer("refinements", options.refinements, 0, kMaxStarts);
    fields.Number("refinement_noise", options.refinement_noise, kMinNoise, kMaxNoise);
  }
};

}  // namespace legopt
