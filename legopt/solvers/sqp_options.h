#pragma once

#include <cstdint>
#include <string>

#include "legopt/types/enum_names.h"

namespace legopt {

/// Rule for resizing the trust box between steps.
enum class TrustRule : std::uint8_t {
  kTrajOpt,   ///< multiplied by the ratios after every step
  kMeasured,  ///< expands only after a step that reached the box and gained more than 3/4 of the predicted decrease,
              ///< and shrinks from the length of the rejected step
};

template <>
inline constexpr auto kEnumNames<TrustRule> = MakeEnumNames<TrustRule>({{TrustRule::kTrajOpt, "trajopt"},
                                                                        {TrustRule::kMeasured, "measured"}});

/// Solver of the convex subproblem.
enum class SubproblemMethod : std::uint8_t {
  kInteriorPoint,  ///< InteriorPointSolver
  kIpopt           ///< IpoptSubproblemSolver: slow, a check of the other one
};

template <>
inline constexpr auto kEnumNames<SubproblemMethod> = MakeEnumNames<SubproblemMethod>(
    {{SubproblemMethod::kInteriorPoint, "interior_point"}, {SubproblemMethod::kIpopt, "ipopt"}});

/// Inner loops that end as soon as the constraints hold after an accepted step, converged or not.
enum class FeasibleStop : std::uint8_t {
  kIncremental,  ///< loops with remembered models: Algorithm 1 of the paper
  kAlways,       ///< all loops, whatever the sample
  kNever         ///< none: loops end when converged
};

template <>
inline constexpr auto kEnumNames<FeasibleStop> = MakeEnumNames<FeasibleStop>(
    {{FeasibleStop::kIncremental, "incremental"}, {FeasibleStop::kAlways, "always"}, {FeasibleStop::kNever, "never"}});

/// Numerical options of the trust-region SQP (docs/explanation/paper.md#sqp). Defaults are TrajOpt's with the paper's
/// penalties; every one is a key under `options:` of a method.
struct SqpOptions {
  double trust_box_size = 0.1;            ///< initial half width s of the trust box; rad and m; > min_trust_box_size
  double min_trust_box_size = 1e-4;       ///< half width below which the loop ends, > 0
  double trust_shrink_ratio = 0.1;        ///< factor of s after a rejected step, (0, 1)
  double trust_expand_ratio = 1.5;        ///< factor of s after an accepted step, >= 1
  double improve_ratio_threshold = 0.25;  ///< steps are accepted if actual >= threshold * predicted decrease, (0, 1)
  double min_approx_improve = 1e-4;       ///< converged if the predicted decrease is smaller, >= 0
  double min_approx_improve_frac = 1e-3;  ///< converged if the predicted decrease is a smaller share of the merit, >= 0
  double constraint_tolerance = 1e-4;     ///< largest allowed violation, (0, 1e-3]
  double initial_penalty = 1e2;           ///< mu of the first penalty iteration (paper), > 0
  double penalty_increase_ratio = 10.0;   ///< factor of mu between penalty iterations, > 1
  int max_penalty_iterations = 11;        ///< mu = 1e2 .. 1e12 (paper), 1..20
  int max_iterations = 50;                ///< convexifications per penalty value, >= 1
  TrustRule trust_rule = TrustRule::kTrajOpt;
  /// If false, a decrease of the remaining violations does not count as an improvement while the constraints hold.
  bool polish_violations = true;
  FeasibleStop stop_when_feasible = FeasibleStop::kIncremental;
  /// Accuracy of a subproblem: it may end at a merit that exceeds its optimum by this share of the merit. It may also
  /// end once no step can reach min_approx_improve; the loop has converged then. > 0
  double subproblem_accuracy_frac = 1e-8;
  /// While the constraints do not hold, a subproblem may also end once its step reaches this share of the largest
  /// possible decrease; 1: never for that reason. [0.1, 1]
  double subproblem_decrease_share = 1.0;
  SubproblemMethod subproblem = SubproblemMethod::kInteriorPoint;

  /// Visits the fields under their keys in `options:` (option_fields.h). `usual_share`: the
  /// subproblem_decrease_share of stored methods without this key; 0: the key is always written.
  static void Visit(auto& options, auto& fields, double usual_share = 1.0) {
    constexpr double kTiny = 1e-12;
    constexpr double kHuge = 1e15;
    fields.Number("trust_box_size", options.trust_box_size, kTiny, 10.0);
    fields.Number("min_trust_box_size", options.min_trust_box_size, kTiny, 1.0);
    fields.Number("trust_shrink_ratio", options.trust_shrink_ratio, 1e-3, 0.99);
    fields.Number("trust_expand_ratio", options.trust_expand_ratio, 1.0, 100.0);
    fields.Number("improve_ratio_threshold", options.improve_ratio_threshold, 1e-6, 0.99);
    fields.Number("min_approx_improve", options.min_approx_improve, 0.0, kHuge);
    fields.Number("min_approx_improve_frac", options.min_approx_improve_frac, 0.0, 1.0);
    fields.Number("constraint_tolerance", options.constraint_tolerance, kTiny, 1e-3);
    fields.Number("initial_penalty", options.initial_penalty, kTiny, kHuge);
    fields.Number("penalty_increase_ratio", options.penalty_increase_ratio, 1.001, 1e6);
    fields.Integer("max_penalty_iterations", options.max_penalty_iterations, 1, 20);
    fields.Integer("max_iterations", options.max_iterations, 1, 100000);
    fields.Choice("trust_rule", options.trust_rule);
    fields.Boolean("polish_violations", options.polish_violations);
    fields.Number("subproblem_accuracy_frac", options.subproblem_accuracy_frac, kTiny, 0.1);
    fields.Choice("subproblem", options.subproblem);
    fields.NumberWithDefault("subproblem_decrease_share", options.subproblem_decrease_share, 0.1, 1.0, usual_share);
    fields.ChoiceWithDefault("stop_when_feasible", options.stop_when_feasible, FeasibleStop::kIncremental);
    fields.Require(options.trust_box_size > options.min_trust_box_size, "trust_box_size", "min_trust_box_size",
                   std::to_string(options.trust_box_size), "must exceed min_trust_box_size",
                   "raise it or lower min_trust_box_size");
  }
};

/// Use of chains: waypoints of a window solved one after the other, each from the one before.
enum class WaypointChains : std::uint8_t {
  kLast,   ///< after all internal restarts that keep the margins
  kFirst,  ///< also before them: faster where most windows need a restart
  kNever
};

template <>
inline constexpr auto kEnumNames<WaypointChains> = MakeEnumNames<WaypointChains>({{WaypointChains::kLast, "last"},
                                                                                  {WaypointChains::kFirst, "first"},
                                                                                  {WaypointChains::kNever, "never"}});

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
  WaypointChains waypoint_chains = WaypointChains::kLast;
  /// How often a window without a solution is solved again together with earlier stances of its motion, three more
  /// each time, >= 0.
  int window_backtracks = 4;
  int refinements = 0;  ///< starts around the feasible solution, to lower its cost; single waypoints only, >= 0
  double refinement_noise = 0.5;  ///< half width of the noise of refinements; rad, m; > 0

  /// Visits the fields under their keys in `options:`, including those of the trust region (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    constexpr int kMaxStarts = 1000;
    constexpr int kMaxBacktracks = 100;
    constexpr int kUsualBacktracks = 4;
    constexpr double kMinNoise = 1e-6;
    constexpr double kMaxNoise = 10.0;
    constexpr double kAlwaysWritten = 0.0;
    SqpOptions::Visit(options.sqp, fields, kAlwaysWritten);
    fields.Integer("free_iterations", options.free_iterations, 0, kMaxStarts);
    fields.Number("window_improve_frac", options.window_improve_frac, 0.0, 1.0);
    fields.Integer("rescues", options.rescues, 0, kMaxStarts);
    fields.Number("rescue_noise", options.rescue_noise, kMinNoise, kMaxNoise);
    fields.Integer("waypoint_starts", options.waypoint_starts, 0, kMaxStarts);
    fields.ChoiceWithDefault("waypoint_chains", options.waypoint_chains, WaypointChains::kLast);
    fields.IntegerWithDefault("window_backtracks", options.window_backtracks, 0, kMaxBacktracks, kUsualBacktracks);
    fields.Integer("refinements", options.refinements, 0, kMaxStarts);
    fields.Number("refinement_noise", options.refinement_noise, kMinNoise, kMaxNoise);
  }
};

}  // namespace legopt
