#include "legopt/optimize/sqp_options.h"

#include "legopt/optimize/option_fields.h"

namespace legopt {

void SqpOptions::Visit(OptionFields& fields) {
  constexpr double kTiny = 1e-12;
  constexpr double kHuge = 1e15;
  fields.Number("trust_box_size", trust_box_size, kTiny, 10.0);
  fields.Number("min_trust_box_size", min_trust_box_size, kTiny, 1.0);
  fields.Number("trust_shrink_ratio", trust_shrink_ratio, 1e-3, 0.99);
  fields.Number("trust_expand_ratio", trust_expand_ratio, 1.0, 100.0);
  fields.Number("improve_ratio_threshold", improve_ratio_threshold, 1e-6, 0.99);
  fields.Number("min_approx_improve", min_approx_improve, 0.0, kHuge);
  fields.Number("min_approx_improve_frac", min_approx_improve_frac, 0.0, 1.0);
  fields.Number("constraint_tolerance", constraint_tolerance, kTiny, 1e-3);
  fields.Number("initial_penalty", initial_penalty, kTiny, kHuge);
  fields.Number("penalty_increase_ratio", penalty_increase_ratio, 1.001, 1e6);
  fields.Integer("max_penalty_iterations", max_penalty_iterations, 1, 20);
  fields.Integer("max_iterations", max_iterations, 1, 100000);
  fields.Choice("trust_rule", trust_rule, {"trajopt", "measured"});
  fields.Boolean("polish_violations", polish_violations);
  fields.Number("subproblem_accuracy_frac", subproblem_accuracy_frac, kTiny, 0.1);
  fields.Choice("subproblem", subproblem, {"interior_point", "ipopt"});
  fields.Require(trust_box_size > min_trust_box_size, "trust_box_size", std::to_string(trust_box_size),
                 "must exceed min_trust_box_size", "raise it or lower min_trust_box_size");
}

}  // namespace legopt
