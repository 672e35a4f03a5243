#pragma once

#include "legopt/optimize/penalty_options.h"
#include "legopt/optimize/waypoint_metric.h"

namespace legopt {

class OptionFields;

/// Options of the STOMP-style solver; every one is a key under `options:` of a method.
struct StompOptions {
  StompOptions() {
    penalty.max_iterations = 1000;
    penalty.max_epochs_without_improvement = 30;
    penalty.max_epochs_when_satisfied = 30;
  }

  PenaltyOptions penalty;
  MetricOptions metric;
  int rollouts = 20;             ///< noisy points per iteration, >= 2
  double noise = 0.05;           ///< standard deviation at the start of a mu, of one waypoint; rad and m, > 0
  double noise_growth = 2.0;     ///< factor after an update that lowered the objective, >= 1
  double noise_shrinkage = 0.9;  ///< factor after one that did not, (0, 1)
  double selectivity = 10.0;     ///< h: weight e^-h of a waypoint's worst rollout against its best, > 0

  void Visit(OptionFields& fields);

  bool operator==(const StompOptions&) const = default;
};

}  // namespace legopt
