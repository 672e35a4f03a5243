#pragma once

#include <Eigen/Core>

#include "legopt/dynamics/inverse_dynamics.h"
#include "legopt/robot/kinematics.h"
#include "legopt/statics/stance_forces.h"

namespace legopt::client {

/// Joint torques of a controller, and how well contact forces can balance the motion.
struct DistributedForces {
  Eigen::VectorXd torques;  ///< n, N m or N
  double imbalance = 0.0;   ///< residual of the balance: norm of forces in weights and moments in weight times 1 m
};

/// Distributes the load of a motion over contacts: the contact forces f_k = M g sum_e lambda_ke v_ke, lambda >= 0, with
/// the least
///
///     |sum_k f_k - M g e_z - force|^2 / (M g)^2 + |sum_k (p_k - c) x f_k - moment|^2 / (M g 1 m)^2 + w^2 |lambda|^2
///
/// by the active-set method of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23), and the torques of
/// InverseDynamics for them. Unlike a linear program's, these forces change continuously with the state, and lie inside
/// the friction cones where possible. Limits of torques and bars do not count.
///
/// A workspace: not thread-safe.
class ForceDistribution {
 public:
  /// `robot` must outlive this object. `gravity_m_s2` > 0.
  ForceDistribution(const RobotModel& robot, double gravity_m_s2) : robot_(robot), gravity_m_s2_(gravity_m_s2) {}

  /// `kinematics`: after Update().
  DistributedForces Compute(const StanceForces& forces, const Kinematics& kinematics, const InertialForces& inertial);

 private:
  const RobotModel& robot_;
  double gravity_m_s2_;
  Eigen::MatrixXd rows_, jacobian_;
  Eigen::VectorXd wanted_;
};

/// Returns the x >= 0 with the least |A x - b|. The columns of A must be linearly independent.
Eigen::VectorXd NonNegativeLeastSquares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace legopt::client
