#pragma once

#include <Eigen/Core>

#include "legopt/optimize/metric_options.h"

namespace legopt {

/// The metric of CHOMP and STOMP on chains of T waypoints, the same for every variable:
///     A = I + smoothness K^T K,   (K x)_t = x_{t+1} - x_t,   T x T,
/// so that A^-1 spreads a change over the neighbouring waypoints and leaves equal changes of all of them as they are.
/// The identity for one waypoint. Vectors are T blocks of equal size. A workspace; one thread.
class WaypointMetric {
 public:
  /// For vectors of num_waypoints * block_size entries. Factors A: cubic in the number of waypoints.
  void Reset(int num_waypoints, int block_size, const MetricOptions& options);

  /// v = A^-1 v.
  void ApplyInverse(Eigen::VectorXd& v) { Multiply(inverse_, v); }

  /// Turns independent standard normal entries into ones of covariance A^-1 along the chain.
  void Correlate(Eigen::VectorXd& v) { Multiply(root_, v); }

 private:
  void Multiply(const Eigen::MatrixXd& factor, Eigen::VectorXd& v);

  int num_waypoints_ = 1, block_size_ = 1;
  Eigen::MatrixXd inverse_;  ///< A^-1
  Eigen::MatrixXd root_;     ///< L^-1, A = L L^T
  Eigen::MatrixXd product_;
};

}  // namespace legopt
