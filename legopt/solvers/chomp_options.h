#pragma once

#include "legopt/solvers/metric_options.h"
#include "legopt/solvers/penalty_options.h"

namespace legopt {

/// Options of CHOMP; every one is a key under `options:` of a method.
struct ChompOptions {
  ChompOptions() { metric.smoothness = 100.0; }

  PenaltyOptions penalty;
  MetricOptions metric;               ///< velocity metric A of the steps
  double sharpness = 1e2;             ///< w of the smooth penalties, as in gradient methods, > 0
  double max_step = 1.0;              ///< largest change of any variable in one step; rad and m, > 0
  double sufficient_decrease = 1e-4;  ///< c1 of Armijo's condition, (0, 1)
  int max_trials = 20;                ///< maximum number of step lengths tried, each half the previous one, >= 1

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    MetricOptions::Visit(options.metric, fields);
    fields.Number("sharpness", options.sharpness, 1e-3, 1e12);
    fields.Number("max_step", options.max_step, 1e-6, 100.0);
    fields.Number("sufficient_decrease", options.sufficient_decrease, 1e-12, 0.5);
    fields.Integer("max_trials", options.max_trials, 1, 200);
  }
};

}  // namespace legopt
