#pragma once

#include "legopt/optimize/sqp_options.h"

namespace legopt {

/// Options of LegOpt-best. Those of the trust region differ from TrajOpt's defaults: a wide box, gentle shrinking and
/// early convergence cost half the iterations and end in better optima.
struct BestOptions {
  /// The trust region of LegOpt-best: what differs from SqpOptions.
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

  SqpOptions sqp = WideSqp();  ///< of every start
  /// Of several waypoints with a free end: steps of a first descent without the terms that can be set aside, the
  /// collisions; 0: none. >= 0
  int free_iterations = 3;
  double window_improve_frac = 0.15;  ///< min_approx_improve_frac of several waypoints, >= 0
  /// Further starts while nothing feasible has been found, >= 0; half as many of chains that are held at both ends.
  int rescues = 8;
  double rescue_noise = 0.15;  ///< half width of their noise on bounded variables; rad, m; > 0
  /// Starts of a waypoint alone: of the rescues of several waypoints, the first begins from the end of the first
  /// descent with its violated waypoints solved alone, the second with all of them; of a single waypoint, the fifth and
  /// later ones begin where it was solved without costs. >= 0; 0: no such rescues.
  int waypoint_starts = 20;
  int refinements = 0;            ///< further starts around the solution, for its cost; single waypoints only, >= 0
  double refinement_noise = 0.5;  ///< half width of their noise, as above

  /// Its keys under `options:`, those of the trust region among them (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    constexpr int kMostStarts = 1000;
    constexpr double kLeastNoise = 1e-6;
    constexpr double kMostNoise = 10.0;
    constexpr double kAlwaysWritten = 0.0;
    SqpOptions::Visit(options.sqp, fields, kAlwaysWritten);
    fields.Integer("free_iterations", options.free_iterations, 0, kMostStarts);
    fields.Number("window_improve_frac", options.window_improve_frac, 0.0, 1.0);
    fields.Integer("rescues", options.rescues, 0, kMostStarts);
    fields.Number("rescue_noise", options.rescue_noise, kLeastNoise, kMostNoise);
    fields.Integer("waypoint_starts", options.waypoint_starts, 0, kMostStarts);
    fields.Integer("refinements", options.refinements, 0, kMostStarts);
    fields.Number("refinement_noise", options.refinement_noise, kLeastNoise, kMostNoise);
  }
};

}  // namespace legopt
