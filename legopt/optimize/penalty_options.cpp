#include "legopt/optimize/penalty_options.h"

#include "legopt/optimize/option_fields.h"

namespace legopt {

void PenaltyOptions::Visit(OptionFields& fields) {
  constexpr double kTiny = 1e-12;
  constexpr double kHuge = 1e15;
  fields.Number("initial_penalty", initial_penalty, kTiny, kHuge);
  fields.Number("penalty_increase_ratio", penalty_increase_ratio, 1.001, 1e6);
  fields.Integer("max_penalty_iterations", max_penalty_iterations, 1, 20);
  fields.Number("constraint_tolerance", constraint_tolerance, kTiny, 1e-3);
  fields.Integer("max_iterations", max_iterations, 1, 100000);
  fields.Integer("max_epochs_without_improvement", max_epochs_without_improvement, 1, 1000);
  fields.Integer("max_epochs_when_satisfied", max_epochs_when_satisfied, 1, 1000);
  fields.Number("min_improve_frac", min_improve_frac, 0.0, 0.99);
}

}  // namespace legopt
