#pragma once

#include <Eigen/Dense>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// The path between two consecutive waypoints: joints and base position move along a straight line, the base turns
/// along the geodesic, R(s) = Exp(s phi) R_a with phi = Log(R_b R_a^T), |phi| <= pi, in world axes.
///
/// x_s = point of the path from x_a to x_b at s in [0, 1]. Configurations of RobotModel (n + 7); quaternions of any
/// non-zero norm and sign, that of x_s is normalised. No allocation.
void InterpolateConfiguration(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> x_a,
                              Eigen::Ref<const Eigen::VectorXd> x_b, double s, Eigen::Ref<Eigen::VectorXd> x_s);

/// How a small turn of the base at either end turns the base at s: dphi_s = from * dphi_a + to * dphi_b, all in the
/// world axes of RobotModel's tangent. The other parts of the tangent simply weigh with 1 - s and s.
struct BaseTurnDerivatives {
  Eigen::Matrix3d from;  ///< multiplies dphi_a
  Eigen::Matrix3d to;    ///< multiplies dphi_b
};

/// With J the left Jacobian of SO(3): to = s J(s phi) J(phi)^-1, from = Exp(s phi) - to Exp(phi). Exact for |phi| < pi;
/// equal to (1 - s) I and s I only where phi = 0 or where the turn is about phi.
BaseTurnDerivatives DifferentiateBaseTurn(const RobotModel& robot, Eigen::Ref<const Eigen::VectorXd> x_a,
                                          Eigen::Ref<const Eigen::VectorXd> x_b, double s);

}  // namespace legopt
