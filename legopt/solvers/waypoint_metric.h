#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "legopt/problem/program.h"

namespace legopt {

/// Differences along a chain of waypoints that a metric penalises.
enum class Differences : std::uint8_t {
  kVelocities,    ///< (K x)_t = x_{t+1} - x_t
  kAccelerations  ///< (K x)_t = x_{t-1} - 2 x_t + x_{t+1}
};

/// Returns whether there is more than one waypoint and the bounds fix the first.
bool FirstWaypointIsFixed(const Program& program);

/// The metric of CHOMP (velocities) and STOMP (accelerations) on chains of T waypoints, the same for every variable:
///
///     A = I + smoothness K^T K,   T x T.
///
/// A^-1 spreads a change over the neighbouring waypoints and does not alter an equal change of all waypoints. Published
/// metrics are K^T K alone, which the fixed ends of their trajectories make invertible; here the ends are free, hence
/// the identity. A first waypoint that is fixed is left out of A, and products with A^-1 are zero there. For one
/// waypoint, A is the identity. Vectors are T blocks of equal size. A workspace; one thread.
class WaypointMetric {
 public:
  /// Prepares for vectors of num_waypoints * block_size entries; smoothness >= 0. Factors A: cubic in the number of
  /// waypoints.
  void Reset(int num_waypoints, int block_size, double smoothness, Differences differences, bool first_fixed = false);

  /// Returns entry (s, t) of A^-1.
  double Inverse(Eigen::Index s, Eigen::Index t) const { return inverse_(s, t); }
  /// Sets v = A^-1 v.
  void ApplyInverse(Eigen::VectorXd& v) { Multiply(inverse_, v); }

  /// Transforms independent standard normal entries to covariance A^-1 / a along the chain, where a is the largest
  /// diagonal entry of A^-1: the waypoint that varies most has variance 1.
  void Correlate(Eigen::VectorXd& v) { Multiply(root_, v); }

  /// Sets v = M v, where M is A^-1 with columns scaled so that their largest entries are 1 / T (STOMP).
  void Smooth(Eigen::VectorXd& v) { Multiply(smoother_, v); }

 private:
  void Multiply(const Eigen::MatrixXd& factor, Eigen::VectorXd& v);

  int num_waypoints_ = 1, block_size_ = 1;
  Eigen::MatrixXd inverse_;   ///< A^-1
  Eigen::MatrixXd root_;      ///< L^-1 / sqrt(a), A = L L^T
  Eigen::MatrixXd smoother_;  ///< M^T
  Eigen::MatrixXd product_;
};

}  // namespace legopt
