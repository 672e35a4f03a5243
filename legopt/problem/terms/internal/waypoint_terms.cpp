#include "legopt/problem/terms/internal/waypoint_terms.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace legopt {

TorqueCostTerm::TorqueCostTerm(int waypoint, WaypointState& state)
    : Term({"torque cost", TermKind::kCost, waypoint, 1}), state_(&state) {
  const RobotModel& robot = state.kinematics().model();
  torque_.setZero(robot.num_dofs());
  jacobian_.setZero(robot.num_dofs(), robot.tangent_size());
}

void TorqueCostTerm::ComputeResiduals(std::vector<double>& residuals) {
  state_->kinematics().GravityTorques(1.0, torque_);
  residuals.insert(residuals.end(), torque_.begin(), torque_.end());
}

void TorqueCostTerm::ComputeModel(LinearModel& model) {
  const Kinematics& kinematics = state_->kinematics();
  const int n = static_cast<int>(torque_.size());
  kinematics.GravityTorques(1.0, torque_);
  kinematics.GravityTorqueJacobian(1.0, jacobian_);
  model.Reset(n, static_cast<int>(jacobian_.cols()), 1);
  for (int i = 0; i < n; ++i) {
    model.value(i) = torque_[i];
    for (Eigen::Index j = 0; j < jacobian_.cols(); ++j) model.row(0, i)[j] = jacobian_(i, j);
  }
}

ContactPoseTerm::ContactPoseTerm(int waypoint, WaypointState& state, int link, const Eigen::Isometry3d& target,
                                 const std::string& name, const Weights& weights)
    : Term({"foot " + name, TermKind::kEquality, waypoint, 1}),
      state_(&state),
      link_(link),
      target_(target),
      weights_(weights),
      weight_(weights.kept) {
  const int size = state.kinematics().model().tangent_size();
  point_jacobian_.setZero(3, size);
  angular_jacobian_.setZero(3, size);
}

Eigen::Matrix<double, 6, 1> ContactPoseTerm::Error(Eigen::Quaterniond& rotation) const {
  const Eigen::Isometry3d error = target_.inverse() * state_->kinematics().link_pose(link_);
  rotation = Eigen::Quaterniond(error.linear());
  if (rotation.w() < 0.0) rotation.coeffs() *= -1.0;
  Eigen::Matrix<double, 6, 1> result;
  result << rotation.vec(), error.translation();
  return result;
}

void ContactPoseTerm::ComputeResiduals(std::vector<double>& residuals) {
  Eigen::Quaterniond rotation;
  const Eigen::Matrix<double, 6, 1> error = weight_ * Error(rotation);
  residuals.insert(residuals.end(), error.begin(), error.end());
}

void ContactPoseTerm::ComputeModel(LinearModel& model) {
  const Kinematics& kinematics = state_->kinematics();
  Eigen::Quaterniond rotation;
  const Eigen::Matrix<double, 6, 1> error = Error(rotation);
  kinematics.PointJacobian(link_, kinematics.link_pose(link_).translation(), point_jacobian_);
  kinematics.AngularJacobian(link_, angular_jacobian_);
  // A rotation by omega (world) premultiplies E by the rotation R_T^T omega: de = (w I - [e]x) R_T^T omega / 2.
  const double half = 0.5 * weight_;
  Eigen::Matrix3d turn = half * rotation.w() * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d e = half * rotation.vec();
  turn(0, 1) += e.z();
  turn(0, 2) -= e.y();
  turn(1, 0) -= e.z();
  turn(1, 2) += e.x();
  turn(2, 0) += e.y();
  turn(2, 1) -= e.x();
  const Eigen::Matrix3d turn_W = turn * target_.linear().transpose();
  const Eigen::Matrix3d to_target = weight_ * target_.linear().transpose();
  const int size = static_cast<int>(point_jacobian_.cols());
  model.Reset(6, size, 1);
  for (int i = 0; i < 3; ++i) {
    model.value(i) = weight_ * error[i];
    model.value(3 + i) = weight_ * error[3 + i];
    Eigen::Map<Eigen::RowVectorXd>(model.row(0, i), size).noalias() = turn_W.row(i) * angular_jacobian_;
    Eigen::Map<Eigen::RowVectorXd>(model.row(0, 3 + i), size).noalias() = to_target.row(i) * point_jacobian_;
  }
}

ContactPointTerm::ContactPointTerm(int waypoint, WaypointState& state, const Contact& contact,
                                   const ContactTarget& target)
    : Term({"foot " + target.contact, TermKind::kEquality, waypoint, 1}),
      state_(&state),
      contact_(&contact),
      target_W_(contact.OriginTarget(target)),
      axes_(target.rotation.normalized().toRotationMatrix().transpose()) {
  jacobian_.setZero(3, state.kinematics().model().tangent_size());
}

Eigen::Vector3d ContactPointTerm::Origin() const {
  return state_->kinematics().link_pose(contact_->link_index) * contact_->X_LC.translation();
}

void ContactPointTerm::ComputeResiduals(std::vector<double>& residuals) {
  const Eigen::Vector3d error = axes_ * (Origin() - target_W_);
  residuals.insert(residuals.end(), error.begin(), error.end());
}

void ContactPointTerm::ComputeModel(LinearModel& model) {
  const Eigen::Vector3d origin = Origin(), error = axes_ * (origin - target_W_);
  state_->kinematics().PointJacobian(contact_->link_index, origin, jacobian_);
  const int size = static_cast<int>(jacobian_.cols());
  model.Reset(3, size, 1);
  for (int i = 0; i < 3; ++i) {
    model.value(i) = error[i];
    Eigen::Map<Eigen::RowVectorXd>(model.row(0, i), size).noalias() = axes_.row(i) * jacobian_;
  }
}

ContactAxisTerm::ContactAxisTerm(int waypoint, WaypointState& state, const Contact& contact,
                                 const ContactTarget& target, double slide_m)
    : Term({"contact " + target.contact, TermKind::kEquality, waypoint, 1}),
      state_(&state),
      contact_(&contact),
      axis_(contact.facts().free_rotation == FreeRotation::kAboutBar ? 0 : 2),
      first_origin_(slide_m > 0.0 ? 1 : 0),
      target_W_(contact.OriginTarget(target)),
      axes_(target.rotation.normalized().toRotationMatrix().transpose()) {
  const int size = state.kinematics().model().tangent_size();
  point_jacobian_.setZero(3, size);
  angular_jacobian_.setZero(3, size);
}

ContactAxisTerm::Error ContactAxisTerm::Measure() const {
  const Eigen::Isometry3d X_WC = state_->kinematics().link_pose(contact_->link_index) * contact_->X_LC;
  return {.axis = axes_ * X_WC.linear().col(axis_), .origin = axes_ * (X_WC.translation() - target_W_)};
}

namespace {

/// Least 1 + cos of the angle between two axes: opposite axes have no smallest rotation.
constexpr double kLeastSum = 1e-6;

/// Factor k of the smallest rotation from the unit axis t to a: its quaternion's vector part is k t x a, with
/// k = (2 (1 + t . a))^(-1/2).
double HalfAngleFactor(double cosine) { return 1.0 / std::sqrt(2.0 * std::max(1.0 + cosine, kLeastSum)); }

}  // namespace

void ContactAxisTerm::ComputeResiduals(std::vector<double>& residuals) {
  const Error error = Measure();
  const Eigen::Vector3d turn = HalfAngleFactor(error.axis[axis_]) * Eigen::Vector3d::Unit(axis_).cross(error.axis);
  for (int i = 0; i < 3; ++i) {
    if (i != axis_) residuals.push_back(turn[i]);
  }
  for (int i = first_origin_; i < 3; ++i) residuals.push_back(error.origin[i]);
}

void ContactAxisTerm::ComputeModel(LinearModel& model) {
  const Kinematics& kinematics = state_->kinematics();
  const int link = contact_->link_index;
  const Error error = Measure();
  kinematics.PointJacobian(link, kinematics.link_pose(link) * contact_->X_LC.translation(), point_jacobian_);
  kinematics.AngularJacobian(link, angular_jacobian_);
  // A rotation by omega, in the axes of the target, changes the axis a by omega x a = -[a]x omega.
  const Eigen::Vector3d t = Eigen::Vector3d::Unit(axis_), cross = t.cross(error.axis);
  const double k = HalfAngleFactor(error.axis[axis_]);
  Eigen::Matrix3d change;  // of a
  change << 0.0, error.axis.z(), -error.axis.y(), -error.axis.z(), 0.0, error.axis.x(), error.axis.y(), -error.axis.x(),
      0.0;
  Eigen::Matrix3d turn;  // of k t x a
  for (int i = 0; i < 3; ++i) turn.col(i) = k * t.cross(change.col(i)) - (k * k * k * change(axis_, i)) * cross;
  const Eigen::Matrix3d turn_W = turn * axes_;
  const int size = static_cast<int>(point_jacobian_.cols());
  model.Reset(5 - first_origin_, size, 1);
  int row = 0;
  for (int i = 0; i < 3; ++i) {
    if (i == axis_) continue;
    model.value(row) = k * cross[i];
    Eigen::Map<Eigen::RowVectorXd>(model.row(0, row++), size).noalias() = turn_W.row(i) * angular_jacobian_;
  }
  for (int i = first_origin_; i < 3; ++i) {
    model.value(row) = error.origin[i];
    Eigen::Map<Eigen::RowVectorXd>(model.row(0, row++), size).noalias() = axes_.row(i) * point_jacobian_;
  }
}

ContactSlideTerm::ContactSlideTerm(int waypoint, WaypointState& state, const Contact& contact,
                                   const ContactTarget& target, double slide_m)
    : Term({"slide of " + target.contact, TermKind::kInequality, waypoint, 1}),
      state_(&state),
      contact_(&contact),
      slide_m_(slide_m),
      target_W_(contact.OriginTarget(target)),
      bar_W_(target.rotation.normalized() * Eigen::Vector3d::UnitX()) {}

double ContactSlideTerm::Distance() const {
  return bar_W_.dot(state_->kinematics().link_pose(contact_->link_index) * contact_->X_LC.translation() - target_W_);
}

void ContactSlideTerm::ComputeResiduals(std::vector<double>& residuals) {
  const double distance = Distance();
  residuals.push_back(distance - slide_m_);
  residuals.push_back(-distance - slide_m_);
}

void ContactSlideTerm::ComputeModel(LinearModel& model) {
  const Kinematics& kinematics = state_->kinematics();
  const int link = contact_->link_index;
  const Eigen::Vector3d origin = kinematics.link_pose(link) * contact_->X_LC.translation();
  const double distance = Distance();
  model.Reset(2, kinematics.model().tangent_size(), 1);
  for (int i = 0; i < 2; ++i) {
    const double sign = i == 0 ? 1.0 : -1.0;
    model.value(i) = sign * distance - slide_m_;
    kinematics.AddPointGradient(link, origin, bar_W_, sign, model.row(0, i));
  }
}

ComTerm::ComTerm(int waypoint, WaypointState& state, std::vector<HalfPlane> edges, double weight)
    : Term({"centre of mass", weight > 0.0 ? TermKind::kPreference : TermKind::kInequality, waypoint, 1, -1, weight}),
      state_(&state),
      edges_(std::move(edges)) {
  jacobian_.setZero(3, state.kinematics().model().tangent_size());
}

void ComTerm::ComputeResiduals(std::vector<double>& residuals) {
  const Eigen::Vector2d com = state_->kinematics().com().head<2>();
  for (const HalfPlane& edge : edges_) residuals.push_back(edge.Distance(com));
}

void ComTerm::ComputeModel(LinearModel& model) {
  state_->kinematics().ComJacobian(jacobian_);
  const int size = static_cast<int>(jacobian_.cols());
  model.Reset(static_cast<int>(edges_.size()), size, 1);
  const Eigen::Vector2d com = state_->kinematics().com().head<2>();
  for (int i = 0; i < model.rows(); ++i) {
    const HalfPlane& edge = edges_[static_cast<size_t>(i)];
    model.value(i) = edge.Distance(com);
    for (int j = 0; j < size; ++j) {
      model.row(0, i)[j] = edge.normal.x() * jacobian_(0, j) + edge.normal.y() * jacobian_(1, j);
    }
  }
}

CollisionTerm::CollisionTerm(int waypoint, WaypointState& state, double margin_m, double relaxed_margin_m)
    : Term({"collision", TermKind::kInequality, waypoint, 1}),
      state_(&state),
      full_margin_m_(margin_m),
      relaxed_margin_m_(relaxed_margin_m),
      margin_m_(margin_m) {}

void CollisionTerm::ComputeResiduals(std::vector<double>& residuals) {
  if (disabled_) return;
  for (const ProximityPair& contact : state_->contacts()) residuals.push_back(margin_m_ - contact.distance_m);
}

void CollisionTerm::RowKeys(int /*rows*/, std::vector<int>& keys) {
  if (disabled_) return;
  for (const ProximityPair& contact : state_->contacts()) keys.push_back(contact.pair_id);
}

void CollisionTerm::ComputeModel(LinearModel& model) {
  const Kinematics& kinematics = state_->kinematics();
  if (disabled_) return model.Reset(0, kinematics.model().tangent_size(), 1);
  const std::vector<ProximityPair>& contacts = state_->contacts();
  model.Reset(static_cast<int>(contacts.size()), kinematics.model().tangent_size(), 1);
  for (int i = 0; i < model.rows(); ++i) {
    const ProximityPair& contact = contacts[static_cast<size_t>(i)];
    model.value(i) = margin_m_ - contact.distance_m;
    kinematics.AddPointGradient(contact.link_a, contact.point_a_W, contact.normal_W, -1.0, model.row(0, i));
    if (contact.link_b == kScene) continue;
    kinematics.AddPointGradient(contact.link_b, contact.point_b_W, contact.normal_W, 1.0, model.row(0, i));
  }
}

}  // namespace legopt
