#pragma once

#include "legopt/solvers/metric_options.h"
#include "legopt/solvers/penalty_options.h"

namespace legopt {

/// Options of STOMP; every one is a key under `options:` of a method.
struct StompOptions {
  StompOptions() {
    penalty.max_epochs = 1000;
    penalty.max_epochs_without_improvement = 30;
    penalty.max_epochs_when_satisfied = 30;
    metric.smoothness = 10.0;
  }

  PenaltyOptions penalty;         ///< longer limits than for gradient methods
  MetricOptions metric;           ///< acceleration metric R of the noise and of the updates
  int rollouts = 20;              ///< noisy points per iteration, >= 2
  double noise = 0.05;            ///< initial standard deviation at the waypoint that varies most; rad and m, > 0
  double noise_floor = 1e-5;      ///< lower limit of the standard deviation, > 0
  double noise_growth = 1.2;      ///< factor after an update that lowered the objective, up to `noise`, >= 1
  double noise_shrinkage = 0.95;  ///< factor after other updates, (0, 1)
  double selectivity = 10.0;      ///< h: a waypoint's worst rollout has e^-h times the weight of its best, > 0

  /// Visits the fields under their keys in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) {
    PenaltyOptions::Visit(options.penalty, fields);
    MetricOptions::Visit(options.metric, fields);
    fields.Integer("rollouts", options.rollouts, 2, 10000);
    fields.Number("noise", options.noise, 1e-9, 10.0);
    fields.Number("noise_floor", options.noise_floor, 1e-12, 10.0);
    fields.Number("noise_growth", options.noise_growth, 1.0, 10.0);
    fields.Number("noise_shrinkage", options.noise_shrinkage, 0.01, 0.999);
    fields.Number("selectivity", options.selectivity, 1e-3, 1e3);
  }
};

}  // namespace legopt
