#pragma once

#include "legopt/optimize/penalty_options.h"

namespace legopt {

/// Options of CMA-ES; every one is a key under `options:` of a method. The strategy's own constants are its author's.
struct CmaEsOptions {
  CmaEsOptions() {
    penalty.max_epochs = 5000;
    penalty.max_epochs_without_improvement = 100;
    penalty.max_epochs_when_satisfied = 100;
  }

  PenaltyOptions penalty;    ///< of the outer loop; an epoch is one generation
  double step = 0.1;         ///< standard deviation of each variable at the start, rad and m, > 0
  double step_floor = 1e-6;  ///< the largest standard deviation of a variable never falls below, (0, step]

  /// Its keys under `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    fields.Number("step", options.step, 1e-9, 10.0);
    fields.Number("step_floor", options.step_floor, 1e-12, 10.0);
  }
};

}  // namespace legopt
