#pragma once

#include <Eigen/Dense>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Interpolates between two consecutive waypoints: joints and base position linearly, the base orientation along the
/// geodesic R(s) = Exp(s phi) R_a with phi = Log(R_b R_a^T), |phi| <= pi, in world axes.
///
/// x_s: point of the path from x_a to x_b at s in [0, 1]. All are configurations of RobotModel (n + 7). Input
/// quaternions may have any non-zero norm and either sign; that of x_s is normalised. No allocation.
void InterpolateConfiguration(Eigen::Ref<const Eigen::VectorXd> x_a, Eigen::Ref<const Eigen::VectorXd> x_b, double s,
                              Eigen::Ref<Eigen::VectorXd> x_s);

/// Derivative of the base orientation at s with respect to both end points: dphi_s = from * dphi_a + to * dphi_b, all
/// in the world axes of RobotModel's tangent. For the other parts of the tangent the factors are 1 - s and s.
struct BaseRotationDerivatives {
  Eigen::Matrix3d from;  ///< multiplies dphi_a
  Eigen::Matrix3d to;    ///< multiplies dphi_b
};

/// Computes to = s J(s phi) J(phi)^-1 and from = Exp(s phi) - to Exp(phi), with J the left Jacobian of SO(3). Exact for
/// |phi| < pi. Equals (1 - s) I and s I only if phi = 0 or if the rotation is about phi.
BaseRotationDerivatives DifferentiateBaseRotation(Eigen::Ref<const Eigen::VectorXd> x_a,
                                                  Eigen::Ref<const Eigen::VectorXd> x_b, double s);

}  // namespace legopt
