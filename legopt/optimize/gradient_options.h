#pragma once

#include "legopt/optimize/line_search.h"
#include "legopt/optimize/penalty_options.h"

namespace legopt {

class OptionFields;

/// Numerical options of gradient methods (SGD; Adam and Nadam add MomentOptions, CHOMP its smoothness). Defaults are
/// the paper's where it has any; every one is a key under `options:` of a method.
struct GradientOptions {
  PenaltyOptions penalty;
  /// w of the smooth penalties, per m or rad, > 0 (docs/readings.md#smooth-penalties). Measured on the postures: 1e2
  /// solves more than 1e4 with every method and faster, and at mu >= 1e4 its optimum still meets the tolerance.
  double sharpness = 1e2;
  LineSearchOptions line_search;

  void Visit(OptionFields& fields);

  bool operator==(const GradientOptions&) const = default;
};

}  // namespace legopt
