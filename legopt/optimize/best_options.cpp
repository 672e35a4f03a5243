#include "legopt/optimize/best_options.h"

#include "legopt/optimize/option_fields.h"

namespace legopt {

void BestOptions::Visit(OptionFields& fields) {
  constexpr int kMostStarts = 1000;
  constexpr double kLeastNoise = 1e-6;
  constexpr double kMostNoise = 10.0;
  sqp.Visit(fields);
  fields.Integer("rescues", rescues, 0, kMostStarts);
  fields.Number("rescue_noise", rescue_noise, kLeastNoise, kMostNoise);
  fields.Integer("refinements", refinements, 0, kMostStarts);
  fields.Number("refinement_noise", refinement_noise, kLeastNoise, kMostNoise);
}

}  // namespace legopt
