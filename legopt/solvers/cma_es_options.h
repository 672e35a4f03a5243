#pragma once

#include "legopt/solvers/penalty_options.h"

namespace legopt {

/// Options of CMA-ES; every one is a key under `options:` of a method. The strategy's other constants are its author's
/// defaults.
struct CmaEsOptions {
  CmaEsOptions() {
    penalty.max_epochs = 5000;
    penalty.max_epochs_without_improvement = 100;
    penalty.max_epochs_when_satisfied = 100;
  }

  PenaltyOptions penalty;    ///< an epoch is one generation
  double step = 0.1;         ///< initial standard deviation of each variable, rad and m, > 0
  double step_floor = 1e-6;  ///< lower limit of the largest standard deviation of any variable, (0, step]

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    fields.Number("step", options.step, 1e-9, 10.0);
    fields.Number("step_floor", options.step_floor, 1e-12, 10.0);
  }
};

}  // namespace legopt
