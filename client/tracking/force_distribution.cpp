#include "client/tracking/force_distribution.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

namespace legopt::client {
namespace {

constexpr double kForceWeight = 0.01;  // w: small, so that balance comes first

/// Returns the least-squares solution with all other variables at 0.
Eigen::VectorXd SolveFree(const Eigen::MatrixXd& square, const Eigen::VectorXd& right, const std::vector<bool>& free) {
  std::vector<Eigen::Index> index;
  for (std::size_t i = 0; i < free.size(); ++i) {
    if (free[i]) index.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::VectorXd part = square(index, index).llt().solve(right(index));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(right.size());
  x(index) = part;
  return x;
}

}  // namespace

Eigen::VectorXd NonNegativeLeastSquares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  const Eigen::MatrixXd square = A.transpose() * A;
  const Eigen::VectorXd right = A.transpose() * b;
  const Eigen::Index n = A.cols();
  const double tolerance = 1e-12 * std::max(1.0, right.cwiseAbs().maxCoeff());
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  std::vector<bool> free(static_cast<std::size_t>(n), false);
  const Eigen::Index most_steps = 3 * n;
  for (Eigen::Index step = 0; step < most_steps; ++step) {
    const Eigen::VectorXd gradient = right - square * x;
    Eigen::Index enters = -1;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (free[static_cast<std::size_t>(i)] || gradient[i] <= tolerance) continue;
      if (enters < 0 || gradient[i] > gradient[enters]) enters = i;
    }
    if (enters < 0) return x;
    free[static_cast<std::size_t>(enters)] = true;
    for (Eigen::VectorXd z = SolveFree(square, right, free);; z = SolveFree(square, right, free)) {
      double share = 1.0;  // the part of the step to z that keeps all free variables positive
      for (Eigen::Index i = 0; i < n; ++i) {
        if (free[static_cast<std::size_t>(i)] && z[i] <= 0.0) share = std::min(share, x[i] / (x[i] - z[i]));
      }
      if (share >= 1.0) {
        x = z;
        break;
      }
      x += share * (z - x);
      for (Eigen::Index i = 0; i < n; ++i) {
        if (!free[static_cast<std::size_t>(i)] || x[i] > tolerance || z[i] > 0.0) continue;
        free[static_cast<std::size_t>(i)] = false;
        x[i] = 0.0;
      }
    }
  }
  return x;
}

DistributedForces ForceDistribution::Compute(const StanceForces& forces, const Kinematics& kinematics,
                                             const InertialForces& inertial) {
  const double unit_N = robot_.total_mass() * gravity_m_s2_;
  const Eigen::Index L = forces.num_generators();
  const Eigen::Vector3d lever = forces.origin_W() - kinematics.com();
  rows_.setZero(6 + L, L);
  for (Eigen::Index l = 0; l < L; ++l) {
    const Eigen::Vector3d v = forces.directions().col(l);
    rows_.col(l).head<3>() = v;
    rows_.col(l).segment<3>(3) = forces.moments().col(l) + lever.cross(v);
    rows_(6 + l, l) = kForceWeight;
  }
  wanted_.setZero(6 + L);
  wanted_.head<3>() = Eigen::Vector3d::UnitZ() + inertial.force_N / unit_N;
  wanted_.segment<3>(3) = inertial.moment_Nm / unit_N;
  const Eigen::VectorXd lambda = NonNegativeLeastSquares(rows_, wanted_);
  DistributedForces result;
  result.imbalance = (rows_.topRows(6) * lambda - wanted_.head<6>()).norm();
  const Eigen::Index n = robot_.num_dofs();
  result.torques.resize(n);
  kinematics.GravityTorques(gravity_m_s2_, result.torques);
  result.torques += inertial.torques;
  for (std::size_t k = 0; k < forces.points().size(); ++k) {
    Eigen::Vector3d force_N = Eigen::Vector3d::Zero();
    for (Eigen::Index l = 0; l < L; ++l) {
      if (forces.point_of(static_cast<int>(l)) == static_cast<int>(k)) {
        force_N += unit_N * lambda[l] * forces.directions().col(l);
      }
    }
    jacobian_.setZero(3, n + 6);
    kinematics.PointJacobian(forces.points()[k].link, forces.points()[k].position_W, jacobian_);
    result.torques -= jacobian_.leftCols(n).transpose() * force_N;
  }
  return result;
}

}  // namespace legopt::client
