#include "legopt/solvers/waypoint_metric.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace legopt {
namespace {

/// Returns K, one row per difference.
Eigen::MatrixXd DifferencesOf(int num_waypoints, Differences differences) {
  const bool velocities = differences == Differences::kVelocities;
  const int width = velocities ? 2 : 3;
  const int rows = std::max(num_waypoints - width + 1, 0);
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(rows, num_waypoints);
  for (int t = 0; t < rows; ++t) {
    if (velocities) {
      k.row(t).segment(t, width) << -1.0, 1.0;
    } else {
      k.row(t).segment(t, width) << 1.0, -2.0, 1.0;
    }
  }
  return k;
}

}  // namespace

bool FirstWaypointIsFixed(const Program& program) {
  const Eigen::Index chain = program.num_waypoints(), size = program.tangent_size();
  if (chain < 2) return false;
  // Fixed variables are the same at every point.
  const Eigen::VectorXd anywhere = Eigen::VectorXd::Zero(chain * program.point_size());
  Eigen::VectorXd lower(chain * size), upper(chain * size);
  program.StepBounds(anywhere, lower, upper);
  return lower.head(size) == upper.head(size);
}

void WaypointMetric::Reset(int num_waypoints, int block_size, double smoothness, Differences differences,
                           bool first_fixed) {
  num_waypoints_ = num_waypoints;
  block_size_ = block_size;
  product_.resize(block_size, num_waypoints);
  for (auto* factor : {&inverse_, &root_, &smoother_}) factor->setZero(num_waypoints, num_waypoints);
  const int free = num_waypoints - (first_fixed ? 1 : 0);
  if (free == 0) return;
  const Eigen::MatrixXd k = DifferencesOf(num_waypoints, differences);
  const Eigen::MatrixXd metric =
      Eigen::MatrixXd::Identity(num_waypoints, num_waypoints) + smoothness * k.transpose() * k;
  const Eigen::LLT<Eigen::MatrixXd> factors(metric.bottomRightCorner(free, free));
  const Eigen::MatrixXd root = factors.matrixL().solve(Eigen::MatrixXd::Identity(free, free));
  const Eigen::MatrixXd inverse = root.transpose() * root;
  inverse_.bottomRightCorner(free, free) = inverse;
  root_.bottomRightCorner(free, free) = root / std::sqrt(inverse.diagonal().maxCoeff());
  for (int s = 0; s < free; ++s) {
    const auto column = inverse.col(s);
    smoother_.bottomRightCorner(free, free).row(s) = column.transpose() / (free * column.cwiseAbs().maxCoeff());
  }
}

void WaypointMetric::Multiply(const Eigen::MatrixXd& factor, Eigen::VectorXd& v) {
  // Column t of the map is waypoint t; row j is one variable along the chain, multiplied from the right.
  Eigen::Map<Eigen::MatrixXd> chain(v.data(), block_size_, num_waypoints_);
  product_.noalias() = chain * factor;
  chain = product_;
}

}  // namespace legopt
