#pragma once

#include <Eigen/Dense>
#include <vector>

#include "legopt/robot/robot_model.h"

namespace legopt {

/// Computes x' from x and the tangent dx (RobotModel): adds joints and base position, base rotation R' = Exp(dphi) R.
/// The quaternion of x' is normalised.
void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
             Eigen::Ref<Eigen::VectorXd> x_next);

/// Forward kinematics, centre of mass, gravity torques and their derivatives at one configuration.
///
/// A workspace: allocated once, not thread-safe, refers to a model that must outlive it. All quantities belong to the
/// configuration of the last update. Jacobian columns follow the tangent [dq, dp, dphi] of RobotModel.
class Kinematics {
 public:
  /// Until the first Update() or UpdatePoses(), only model() may be called.
  explicit Kinematics(const RobotModel& model);

  const RobotModel& model() const { return *model_; }

  /// Computes all link poses and centres of mass. `x`: configuration, size n + 7; quaternion of any non-zero norm.
  void Update(Eigen::Ref<const Eigen::VectorXd> x);

  /// Computes link poses and the data that point gradients and Jacobians need. Centres of mass, torques and their
  /// derivatives are undefined until the next Update().
  void UpdatePoses(Eigen::Ref<const Eigen::VectorXd> x);

  /// Returns the pose of a link's frame in the world, X_WL.
  const Eigen::Isometry3d& link_pose(int link) const { return link_poses_[static_cast<size_t>(link)]; }

  /// Centre of mass of the whole robot in the world frame, m.
  const Eigen::Vector3d& com() const { return com_; }

  /// Adds scale * d(n . p)/dx to `row` (n + 6 doubles), for the point p_W fixed in `link` and a constant direction n_W.
  void AddPointGradient(int link, const Eigen::Vector3d& p_W, const Eigen::Vector3d& n_W, double scale,
                        double* row) const;

  /// Adds d(w . J^T f)/dx to `row` (n + 6 doubles): J is the Jacobian of the point of `link` that is at p_W, a place
  /// fixed in the world, as in PointJacobian; f_W is a constant force, w has one weight per degree of freedom.
  void AddPointTorqueGradient(int link, const Eigen::Vector3d& p_W, const Eigen::Vector3d& f_W,
                              const Eigen::VectorXd& weights, double* row) const;

  /// Computes the Jacobian (3 x n+6) of the point p_W fixed in `link`, world axes.
  void PointJacobian(int link, const Eigen::Vector3d& p_W, Eigen::Ref<Eigen::MatrixXd> jacobian) const;

  /// Computes the Jacobian (3 x n+6) of the angular velocity of `link`, world axes.
  void AngularJacobian(int link, Eigen::Ref<Eigen::MatrixXd> jacobian) const;

  /// Computes the Jacobian (3 x n+6) of com().
  void ComJacobian(Eigen::Ref<Eigen::MatrixXd> jacobian) const;

  /// Computes the torques (forces) that hold the robot against gravity with a fixed base and without contacts
  /// (docs/explanation/judge.md#cost): tau_i = g M_i [a_i x (C_i - o_i)]_z with M_i, C_i mass and COM of the subtree of
  /// joint i. The torque of a degree of freedom with followers is sum_k m_k tau_k over its joints, by the principle of
  /// virtual work. `g` in m/s^2; `tau`: n entries, N m or N.
  void GravityTorques(double g, Eigen::Ref<Eigen::VectorXd> tau) const;

  /// Computes d tau / dx (n x n+6). Its joint block is the Hessian of the potential energy, hence symmetric.
  void GravityTorqueJacobian(double g, Eigen::Ref<Eigen::MatrixXd> jacobian) const;

  /// Computes the Jacobian for a weight in any direction: `g_W` points against it, m/s^2. A horizontal push of the
  /// centre of mass, for example, tilts the weight.
  void GravityTorqueJacobian(const Eigen::Vector3d& g_W, Eigen::Ref<Eigen::MatrixXd> jacobian) const;

 private:
  template <class Lift>
  void LeverJacobian(double g, const Lift& lift, Eigen::Ref<Eigen::MatrixXd> jacobian) const;

  enum class AxisKind { kX, kY, kZ, kGeneral, kPrismatic };

  /// Joint that moves body k = index + 1, in the frame of the parent body.
  struct BodyJoint {
    Eigen::Matrix3d rotation;
    Eigen::Vector3d translation;
    Eigen::Vector3d axis;
    bool rotated = false;  ///< false if rotation is the identity
    AxisKind kind = AxisKind::kGeneral;
    int parent = 0;
    int dof = 0;              ///< degree of freedom, of the leader if the joint follows another one
    bool follows = false;     ///< q = multiplier * x[dof] + offset, else q = x[dof]
    double multiplier = 1.0;  ///< dq / dx[dof]
    double offset = 0.0;
  };

  /// Adds the derivative for a joint's value to the column of its degree of freedom. Without followers, each column is
  /// written once.
  template <class Vector>
  void AddColumn(const BodyJoint& joint, const Vector& derivative, Eigen::Ref<Eigen::MatrixXd> jacobian) const {
    if (model_->has_followers()) {
      jacobian.col(joint.dof) += joint.multiplier * derivative;
    } else {
      jacobian.col(joint.dof) = derivative;
    }
  }

  void UpdateBody(int body, double q);
  void UpdateMasses();

  const RobotModel* model_;
  std::vector<BodyJoint> body_joints_;
  std::vector<double> body_mass_;          ///< mass of each body without its subtree
  std::vector<Eigen::Vector3d> body_com_;  ///< body frame
  std::vector<double> subtree_mass_;
  std::vector<int> frame_links_;  ///< links whose frame differs from their body's

  std::vector<Eigen::Matrix3d> rotation_;        ///< per body, world
  std::vector<Eigen::Vector3d> origin_;          ///< per body, world
  std::vector<Eigen::Vector3d> axis_W_;          ///< per body but the base, index body - 1
  std::vector<Eigen::Vector3d> subtree_moment_;  ///< sum of m * com of the subtree, per body, world
  std::vector<Eigen::Vector3d> lever_;           ///< M_i dC_i/dq_i, as axis_W_
  std::vector<Eigen::Isometry3d> link_poses_;
  Eigen::Vector3d com_ = Eigen::Vector3d::Zero();
};

}  // namespace legopt
