#include "legopt/robot/kinematics.h"

#include <cmath>

#include "legopt/robot/configuration.h"

namespace legopt {
namespace {

constexpr double kAxisTolerance = 1e-12;
constexpr double kNegligibleAngle = 1e-8;

/// Rotates the columns of `rotation` about its own axis number `axis` by the angle with cosine c and sine s.
void RotateAboutOwnAxis(int axis, double c, double s, Eigen::Matrix3d& rotation) {
  const int j = (axis + 1) % 3;
  const int k = (axis + 2) % 3;
  const Eigen::Vector3d col_j = rotation.col(j);
  const Eigen::Vector3d col_k = rotation.col(k);
  rotation.col(j) = c * col_j + s * col_k;
  rotation.col(k) = c * col_k - s * col_j;
}

Eigen::Matrix3d RotationAbout(const Eigen::Vector3d& axis, double c, double s) {
  Eigen::Matrix3d r = (1.0 - c) * axis * axis.transpose();
  r.diagonal().array() += c;
  r(0, 1) -= s * axis.z();
  r(0, 2) += s * axis.y();
  r(1, 0) += s * axis.z();
  r(1, 2) -= s * axis.x();
  r(2, 0) -= s * axis.y();
  r(2, 1) += s * axis.x();
  return r;
}

}  // namespace

void Retract(Eigen::Ref<const Eigen::VectorXd> x, Eigen::Ref<const Eigen::VectorXd> dx,
             Eigen::Ref<Eigen::VectorXd> x_next) {
  const auto from = PartsOf(x);
  const auto to = MutablePartsOf(x_next);
  const auto step = TangentPartsOf(dx);
  to.linear() = from.linear() + step.linear();
  const Eigen::Vector3d phi = step.base_rotation();
  const double angle = phi.norm();
  const double half_sinc = angle < kNegligibleAngle ? 0.5 : std::sin(0.5 * angle) / angle;
  const Eigen::Quaterniond turn(std::cos(0.5 * angle), half_sinc * phi.x(), half_sinc * phi.y(), half_sinc * phi.z());
  to.set_base_quaternion((turn * from.base_quaternion()).normalized());
}

Kinematics::Kinematics(const RobotModel& model) : model_(&model) {
  const auto bodies = static_cast<size_t>(model.num_bodies());
  const size_t moving = bodies - 1;
  body_joints_.resize(moving);
  for (size_t k = 0; k < moving; ++k) {
    const Joint& joint = model.joints()[static_cast<size_t>(model.body_joint(static_cast<int>(k) + 1))];
    const Eigen::Isometry3d in_parent = model.link_in_body(joint.parent_link) * joint.origin;
    BodyJoint& body = body_joints_[k];
    body.rotation = in_parent.linear();
    body.translation = in_parent.translation();
    body.rotated = !body.rotation.isIdentity(kAxisTolerance);
    body.axis = joint.axis;
    body.parent = model.body_parent(static_cast<int>(k) + 1);
    body.dof = joint.dof;
    body.follows = joint.leader >= 0;
    body.multiplier = joint.multiplier;
    body.offset = joint.offset;
    body.kind = AxisKind::kGeneral;
    if (joint.type == JointType::kPrismatic) {
      body.kind = AxisKind::kPrismatic;
    } else if ((joint.axis - Eigen::Vector3d::UnitX()).norm() < kAxisTolerance) {
      body.kind = AxisKind::kX;
    } else if ((joint.axis - Eigen::Vector3d::UnitY()).norm() < kAxisTolerance) {
      body.kind = AxisKind::kY;
    } else if ((joint.axis - Eigen::Vector3d::UnitZ()).norm() < kAxisTolerance) {
      body.kind = AxisKind::kZ;
    }
  }

  body_mass_.assign(bodies, 0.0);
  body_com_.assign(bodies, Eigen::Vector3d::Zero());
  for (size_t l = 0; l < model.links().size(); ++l) {
    const Link& link = model.links()[l];
    const auto body = static_cast<size_t>(model.link_body(static_cast<int>(l)));
    body_mass_[body] += link.mass;
    body_com_[body] += link.mass * (model.link_in_body(static_cast<int>(l)) * link.com);
    const Joint* joint = link.parent_joint < 0 ? nullptr : &model.joints()[static_cast<size_t>(link.parent_joint)];
    if (joint != nullptr && joint->type == JointType::kFixed) frame_links_.push_back(static_cast<int>(l));
  }
  subtree_mass_ = body_mass_;
  for (size_t body = bodies; body-- > 1;) {
    subtree_mass_[static_cast<size_t>(body_joints_[body - 1].parent)] += subtree_mass_[body];
  }
  for (size_t body = 0; body < bodies; ++body) {
    if (body_mass_[body] > 0.0) body_com_[body] /= body_mass_[body];
  }

  rotation_.assign(bodies, Eigen::Matrix3d::Identity());
  origin_.assign(bodies, Eigen::Vector3d::Zero());
  subtree_moment_.assign(bodies, Eigen::Vector3d::Zero());
  axis_W_.assign(moving, Eigen::Vector3d::Zero());
  lever_.assign(moving, Eigen::Vector3d::Zero());
  link_poses_.assign(model.links().size(), Eigen::Isometry3d::Identity());
}

void Kinematics::Update(Eigen::Ref<const Eigen::VectorXd> x) {
  UpdatePoses(x);
  UpdateMasses();
}

void Kinematics::UpdatePoses(Eigen::Ref<const Eigen::VectorXd> x) {
  const auto parts = PartsOf(x);
  rotation_[0] = parts.base_rotation().toRotationMatrix();
  origin_[0] = parts.base_position();
  link_poses_[0].linear() = rotation_[0];
  link_poses_[0].translation() = origin_[0];
  for (int body = 1; body < model_->num_bodies(); ++body) {
    const BodyJoint& joint = body_joints_[static_cast<size_t>(body) - 1];
    UpdateBody(body, joint.follows ? joint.multiplier * x[joint.dof] + joint.offset : x[joint.dof]);
  }
  for (const int link : frame_links_) {
    const auto body = static_cast<size_t>(model_->link_body(link));
    const Eigen::Isometry3d& in_body = model_->link_in_body(link);
    Eigen::Isometry3d& pose = link_poses_[static_cast<size_t>(link)];
    pose.linear().noalias() = rotation_[body] * in_body.linear();
    pose.translation().noalias() = rotation_[body] * in_body.translation();
    pose.translation() += origin_[body];
  }
}

void Kinematics::UpdateBody(int body, double q) {
  const auto b = static_cast<size_t>(body);
  const BodyJoint& joint = body_joints_[b - 1];
  const auto parent = static_cast<size_t>(joint.parent);
  Eigen::Matrix3d& rotation = rotation_[b];
  if (joint.rotated) {
    rotation.noalias() = rotation_[parent] * joint.rotation;
  } else {
    rotation = rotation_[parent];
  }
  origin_[b].noalias() = rotation_[parent] * joint.translation;
  origin_[b] += origin_[parent];
  const int unit_axis = static_cast<int>(joint.kind);
  if (unit_axis < 3) {
    axis_W_[b - 1] = rotation.col(unit_axis);
    RotateAboutOwnAxis(unit_axis, std::cos(q), std::sin(q), rotation);
  } else {
    axis_W_[b - 1].noalias() = rotation * joint.axis;
    if (joint.kind == AxisKind::kPrismatic) {
      origin_[b] += q * axis_W_[b - 1];
    } else {
      rotation = rotation * RotationAbout(joint.axis, std::cos(q), std::sin(q));
    }
  }
  const int child = model_->joints()[static_cast<size_t>(model_->body_joint(body))].child_link;
  Eigen::Isometry3d& pose = link_poses_[static_cast<size_t>(child)];
  pose.linear() = rotation;
  pose.translation() = origin_[b];
}

void Kinematics::UpdateMasses() {
  const size_t bodies = body_mass_.size();
  for (size_t body = 0; body < bodies; ++body) {
    subtree_moment_[body].noalias() = rotation_[body] * body_com_[body];
    subtree_moment_[body] = body_mass_[body] * (subtree_moment_[body] + origin_[body]);
  }
  for (size_t body = bodies; body-- > 1;) {
    const BodyJoint& joint = body_joints_[body - 1];
    subtree_moment_[static_cast<size_t>(joint.parent)] += subtree_moment_[body];
    lever_[body - 1] =
        joint.kind == AxisKind::kPrismatic
            ? Eigen::Vector3d(subtree_mass_[body] * axis_W_[body - 1])
            : Eigen::Vector3d(axis_W_[body - 1].cross(subtree_moment_[body] - subtree_mass_[body] * origin_[body]));
  }
  com_ = subtree_moment_[0] / (subtree_mass_[0] > 0.0 ? subtree_mass_[0] : 1.0);
}

void Kinematics::AddPointGradient(int link, const Eigen::Vector3d& p_W, const Eigen::Vector3d& n_W, double scale,
                                  double* row) const {
  const Eigen::Vector3d direction = scale * n_W;
  const Eigen::Vector3d moment = p_W.cross(direction);  // n . (a x (p - o)) = a . (p x n - o x n)
  for (const int body : model_->body_chain(model_->link_body(link))) {
    const auto d = static_cast<size_t>(body) - 1;
    const BodyJoint& joint = body_joints_[d];
    row[joint.dof] += joint.multiplier * (joint.kind == AxisKind::kPrismatic
                                              ? axis_W_[d].dot(direction)
                                              : axis_W_[d].dot(moment - origin_[d + 1].cross(direction)));
  }
  const Eigen::Vector3d base_moment = moment - origin_[0].cross(direction);
  const TangentView<double> parts(row, model_->tangent_size());
  parts.base_position() += direction;
  parts.base_rotation() += base_moment;
}

void Kinematics::AddPointTorqueGradient(int link, const Eigen::Vector3d& p_W, const Eigen::Vector3d& f_W,
                                        const Eigen::VectorXd& weights, double* row) const {
  // For a point fixed in the link, J^T f is the gradient of f . p, so its derivative is symmetric: d2(f . p) = a_i .
  // (dp_j x f) for i above j. A place fixed in the world does not move with the link: less a_j x dp_i . f.
  const std::vector<int>& chain = model_->body_chain(model_->link_body(link));
  const TangentView<double> parts(row, model_->tangent_size());
  Eigen::Vector3d axes = Eigen::Vector3d::Zero();
  for (size_t lower = 0; lower < chain.size(); ++lower) {
    const auto j = static_cast<size_t>(chain[lower]) - 1;
    const BodyJoint& joint = body_joints_[j];
    const Eigen::Vector3d rate =
        joint.kind == AxisKind::kPrismatic ? axis_W_[j] : Eigen::Vector3d(axis_W_[j].cross(p_W - origin_[j + 1]));
    const Eigen::Vector3d turned = rate.cross(f_W);
    const double weight = weights[joint.dof] * joint.multiplier;
    if (joint.kind != AxisKind::kPrismatic) axes += weight * axis_W_[j];
    for (size_t upper = 0; upper <= lower; ++upper) {
      const auto i = static_cast<size_t>(chain[upper]) - 1;
      const BodyJoint& other = body_joints_[i];
      if (other.kind == AxisKind::kPrismatic) continue;  // a translation does not turn the joints below it
      const double entry = axis_W_[i].dot(turned);
      row[other.dof] += weight * other.multiplier * entry;
      if (upper != lower) row[joint.dof] += weights[other.dof] * other.multiplier * joint.multiplier * entry;
    }
    parts.base_rotation() += weight * turned;
  }
  AddPointGradient(link, p_W, f_W.cross(axes), -1.0, row);
}

void Kinematics::PointJacobian(int link, const Eigen::Vector3d& p_W, Eigen::Ref<Eigen::MatrixXd> jacobian) const {
  jacobian.setZero();
  for (const int body : model_->body_chain(model_->link_body(link))) {
    const auto d = static_cast<size_t>(body) - 1;
    if (body_joints_[d].kind == AxisKind::kPrismatic) {
      AddColumn(body_joints_[d], axis_W_[d], jacobian);
    } else {
      AddColumn(body_joints_[d], axis_W_[d].cross(p_W - origin_[d + 1]), jacobian);
    }
  }
  jacobian.middleCols<3>(model_->base_position_index()).setIdentity();
  const Eigen::Vector3d r = p_W - origin_[0];
  const int turn = model_->base_rotation_index();
  for (int k = 0; k < 3; ++k) jacobian.col(turn + k) = Eigen::Vector3d::Unit(k).cross(r);
}

void Kinematics::AngularJacobian(int link, Eigen::Ref<Eigen::MatrixXd> jacobian) const {
  jacobian.setZero();
  for (const int body : model_->body_chain(model_->link_body(link))) {
    const auto d = static_cast<size_t>(body) - 1;
    if (body_joints_[d].kind != AxisKind::kPrismatic) AddColumn(body_joints_[d], axis_W_[d], jacobian);
  }
  jacobian.middleCols<3>(model_->base_rotation_index()).setIdentity();
}

void Kinematics::ComJacobian(Eigen::Ref<Eigen::MatrixXd> jacobian) const {
  const int n = model_->num_dofs();
  const double inverse_mass = 1.0 / subtree_mass_[0];
  jacobian.leftCols(n).setZero();
  for (size_t k = 0; k < body_joints_.size(); ++k) AddColumn(body_joints_[k], inverse_mass * lever_[k], jacobian);
  jacobian.middleCols<3>(model_->base_position_index()).setIdentity();
  const Eigen::Vector3d r = com_ - origin_[0];
  const int turn = model_->base_rotation_index();
  for (int k = 0; k < 3; ++k) jacobian.col(turn + k) = Eigen::Vector3d::Unit(k).cross(r);
}

void Kinematics::GravityTorques(double g, Eigen::Ref<Eigen::VectorXd> tau) const {
  if (model_->has_followers()) tau.setZero();
  for (size_t k = 0; k < body_joints_.size(); ++k) {
    const BodyJoint& joint = body_joints_[k];
    const double torque = g * lever_[k].z();
    tau[joint.dof] = model_->has_followers() ? tau[joint.dof] + joint.multiplier * torque : torque;
  }
}

/// `lift`: component of axis x lever against the weight.
template <class Lift>
void Kinematics::LeverJacobian(double g, const Lift& lift, Eigen::Ref<Eigen::MatrixXd> jacobian) const {
  jacobian.setZero();
  const int turn = model_->base_rotation_index();
  for (int body = 1; body < model_->num_bodies(); ++body) {
    const auto k = static_cast<size_t>(body) - 1;
    const BodyJoint& joint = body_joints_[k];
    const Eigen::Vector3d v = g * lever_[k];
    for (const int above : model_->body_chain(body)) {  // ancestors of the body and the body itself
      const auto d = static_cast<size_t>(above) - 1;
      const BodyJoint& other = body_joints_[d];
      if (other.kind == AxisKind::kPrismatic) continue;  // translation: does not rotate the lever
      const double entry = joint.multiplier * other.multiplier * lift(axis_W_[d], v);
      jacobian(joint.dof, other.dof) += entry;
      if (above != body) jacobian(other.dof, joint.dof) += entry;
    }
    for (int axis = 0; axis < 3; ++axis) {
      jacobian(joint.dof, turn + axis) += joint.multiplier * lift(Eigen::Vector3d::Unit(axis), v);
    }
  }
}

void Kinematics::GravityTorqueJacobian(double g, Eigen::Ref<Eigen::MatrixXd> jacobian) const {
  const auto lift = [](const Eigen::Vector3d& axis, const Eigen::Vector3d& v) {
    return axis.x() * v.y() - axis.y() * v.x();
  };
  LeverJacobian(g, lift, jacobian);
}

void Kinematics::GravityTorqueJacobian(const Eigen::Vector3d& g_W, Eigen::Ref<Eigen::MatrixXd> jacobian) const {
  const auto lift = [&g_W](const Eigen::Vector3d& axis, const Eigen::Vector3d& v) { return g_W.dot(axis.cross(v)); };
  LeverJacobian(1.0, lift, jacobian);
}

}  // namespace legopt
