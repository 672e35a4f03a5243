#include "legopt/optimize/waypoint_metric.h"

#include <Eigen/Cholesky>

namespace legopt {

void WaypointMetric::Reset(int num_waypoints, int block_size, const MetricOptions& options) {
  const double smoothness = options.smoothness;
  num_waypoints_ = num_waypoints;
  block_size_ = block_size;
  Eigen::MatrixXd metric = Eigen::MatrixXd::Identity(num_waypoints, num_waypoints);
  for (int t = 0; t + 1 < num_waypoints; ++t) {
    metric(t, t) += smoothness;
    metric(t + 1, t + 1) += smoothness;
    metric(t, t + 1) -= smoothness;
    metric(t + 1, t) -= smoothness;
  }
  const Eigen::LLT<Eigen::MatrixXd> factors(metric);
  root_ = factors.matrixL().solve(Eigen::MatrixXd::Identity(num_waypoints, num_waypoints));
  inverse_ = root_.transpose() * root_;
  product_.resize(block_size, num_waypoints);
}

void WaypointMetric::Multiply(const Eigen::MatrixXd& factor, Eigen::VectorXd& v) {
  // Column t of the map is waypoint t; row j is one variable along the chain, multiplied from the right.
  Eigen::Map<Eigen::MatrixXd> chain(v.data(), block_size_, num_waypoints_);
  product_.noalias() = chain * factor;
  chain = product_;
}

}  // namespace legopt
