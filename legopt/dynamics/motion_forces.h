#pragma once

#include <Eigen/Core>
#include <vector>

#include "legopt/dynamics/inverse_dynamics.h"
#include "legopt/robot/kinematics.h"
#include "legopt/robot/robot_model.h"
#include "legopt/statics/internal/linear_program.h"
#include "legopt/statics/stance_forces.h"

namespace legopt {

/// Contact forces and joint torques of a robot in motion.
struct RealizedForces {
  std::vector<Eigen::Vector3d> forces_N;  ///< forces on the robot at StanceForces::points(), in the world
  Eigen::VectorXd torques;                ///< n, N m or N
  double imbalance = 0.0;                 ///< largest residual of the balance, in weights (forces) and weight times 1 m
  double torque_ratio = 0.0;              ///< largest |torque| / effort limit; 0 without limits
};

/// Computes contact forces f_k and joint torques tau that realise given inertial forces (InverseDynamics):
///
///     sum_k f_k = M g e_z + force,    sum_k (p_k - c) x f_k = moment,    tau = g(q) + torques - sum_k J_k^T f_k
///
/// Of the many, one linear program takes those with, in this order: balance within `slack` and torques within their
/// limits, if that is possible; the least imbalance; the least torque ratio; the least sum of forces. Neighbouring
/// instants of a motion can have different forces.
///
/// A workspace: not thread-safe. Results do not depend on the calls before.
class MotionForces {
 public:
  /// `robot` must outlive this object. `gravity_m_s2` >= 0.
  MotionForces(const RobotModel& robot, double gravity_m_s2);

  /// `kinematics`: after Update(). `slack`: in weights, and weight times 1 m; > 0.
  RealizedForces Compute(const StanceForces& forces, const Kinematics& kinematics, const InertialForces& inertial,
                         double slack);

 private:
  void SetLoads(const StanceForces& forces, const Kinematics& kinematics, const InertialForces& inertial);
  void SetProgram(const StanceForces& forces, double slack);
  RealizedForces ForcesOf(const StanceForces& forces, const Eigen::VectorXd& lambda) const;

  const RobotModel& robot_;
  double gravity_m_s2_;
  double unit_N_;                      ///< weight M g, N; M times 9.81 m/s^2 without gravity
  std::vector<int> loaded_;            ///< degrees of freedom with an effort limit that contacts load
  Eigen::VectorXd free_torques_;       ///< n: torques without contacts
  Eigen::MatrixXd jacobian_, shares_;  ///< shares_: n x generators, torques per weight
  Eigen::Matrix<double, 6, 1> demand_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrenches_;  ///< forces and moments about the centre of mass per generator
  LinearProgram program_;
  Eigen::VectorXd cost_;
  LinearProgramSolver solver_;
};

}  // namespace legopt
