#pragma once

namespace legopt {

/// Options that CHOMP and STOMP share (waypoint_metric.h).
struct MetricOptions {
  double smoothness = 1.0;  ///< weight of the differences between waypoints, >= 0

  /// Visits the field under its key in `options:` (option_fields.h).
  static void Visit(auto& options, auto& fields) { fields.Number("smoothness", options.smoothness, 0.0, 1e9); }
};

}  // namespace legopt
