#include "legopt/optimize/stomp_options.h"

#include "legopt/optimize/option_fields.h"

namespace legopt {

void StompOptions::Visit(OptionFields& fields) {
  penalty.Visit(fields);
  metric.Visit(fields);
  fields.Integer("rollouts", rollouts, 2, 10000);
  fields.Number("noise", noise, 1e-9, 10.0);
  fields.Number("noise_growth", noise_growth, 1.0, 10.0);
  fields.Number("noise_shrinkage", noise_shrinkage, 0.01, 0.999);
  fields.Number("selectivity", selectivity, 1e-3, 1e3);
}

}  // namespace legopt
