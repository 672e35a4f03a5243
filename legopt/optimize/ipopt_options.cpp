#include "legopt/optimize/ipopt_options.h"

#include "legopt/optimize/option_fields.h"

namespace legopt {

void IpoptOptions::Visit(OptionFields& fields) {
  constexpr double kTiny = 1e-12;
  fields.Integer("max_iterations", max_iterations, 1, 100000);
  fields.Integer("max_rounds", max_rounds, 1, 1000);
  fields.Number("tolerance", tolerance, kTiny, 1.0);
  fields.Number("stagnation_frac", stagnation_frac, 0.0, 1.0);
  fields.Number("constraint_tolerance", constraint_tolerance, kTiny, 1e-3);
  fields.Choice("hessian", hessian, {"gauss_newton", "limited_memory"});
  fields.Number("damping", damping, 0.0, 1e6);
  fields.Choice("barrier", barrier, {"monotone", "adaptive"});
}

}  // namespace legopt
