#pragma once

#include <string>

namespace legopt {

class OptionFields;

/// Numerical options of the trust-region SQP (docs/readings.md#sqp). Defaults are TrajOpt's with the paper's penalties;
/// every one is a key under `options:` of a method.
struct SqpOptions {
  double trust_box_size = 0.1;            ///< initial half width s of the trust box; rad and m. > min_trust_box_size
  double min_trust_box_size = 1e-4;       ///< the loop ends below this. > 0
  double trust_shrink_ratio = 0.1;        ///< s after a rejected step, (0, 1)
  double trust_expand_ratio = 1.5;        ///< s after an accepted step, >= 1
  double improve_ratio_threshold = 0.25;  ///< accept when actual >= threshold * predicted decrease, (0, 1)
  double min_approx_improve = 1e-4;       ///< converged when the predicted decrease is smaller, >= 0
  double min_approx_improve_frac = 1e-3;  ///< the same relative to the merit, >= 0
  double constraint_tolerance = 1e-4;     ///< of each violation, (0, 1e-3]: docs/readings.md#solver-tolerance
  double initial_penalty = 1e2;           ///< mu of the first penalty iteration (paper), > 0
  double penalty_increase_ratio = 10.0;   ///< > 1
  int max_penalty_iterations = 11;        ///< mu = 1e2 .. 1e12 (paper), 1..20
  int max_iterations = 50;                ///< convexifications per penalty value, >= 1
  /// Trust box between steps: "trajopt" multiplies by the ratios above after every step; "measured" expands only after
  /// a step that reached the box and gained more than 3/4 of what was predicted, and shrinks from the rejected step.
  std::string trust_rule = "trajopt";
  /// false: while the constraints hold, a decrease of their remaining violations does not count as an improvement.
  bool polish_violations = true;
  double subproblem_accuracy_frac = 1e-8;     ///< a subproblem may end this share of the merit above its optimum, > 0
  std::string subproblem = "interior_point";  ///< or "ipopt"

  void Visit(OptionFields& fields);

  bool operator==(const SqpOptions&) const = default;
};

}  // namespace legopt
