#include "legopt/optimize/gradient_options.h"

#include "legopt/optimize/option_fields.h"

namespace legopt {

void GradientOptions::Visit(OptionFields& fields) {
  penalty.Visit(fields);
  fields.Number("sharpness", sharpness, 1e-3, 1e12);
  line_search.Visit(fields);
}

}  // namespace legopt
