#include "legopt/problem/terms/velocity_term.h"

#include "legopt/robot/configuration.h"
namespace legopt {
namespace {

/// Returns R_to R_from^T as the quaternion with w >= 0.
Eigen::Quaterniond RelativeRotation(const Eigen::VectorXd& from, const Eigen::VectorXd& to) {
  Eigen::Quaterniond turn = PartsOf(to).base_rotation() * PartsOf(from).base_rotation().conjugate();
  if (turn.w() < 0.0) turn.coeffs() *= -1.0;
  return turn;
}

}  // namespace

void ConfigurationDifference(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                             Eigen::Ref<Eigen::VectorXd> difference) {
  const auto parts = MutableTangentPartsOf(difference);
  parts.linear() = PartsOf(to).linear() - PartsOf(from).linear();
  parts.base_rotation() = 2.0 * RelativeRotation(from, to).vec();
}

VelocityCostTerm::VelocityCostTerm(int waypoint, int unit, const WaypointState& from, const WaypointState& to)
    : Term({"velocity cost", TermKind::kCost, waypoint, 2, unit}), from_(&from), to_(&to) {
  difference_.setZero(from.kinematics().model().tangent_size());
}

void VelocityCostTerm::ComputeResiduals(std::vector<double>& residuals) {
  ConfigurationDifference(from_->configuration(), to_->configuration(), difference_);
  residuals.insert(residuals.end(), difference_.begin(), difference_.end());
}

void VelocityCostTerm::ComputeModel(LinearModel& model) {
  ConfigurationDifference(from_->configuration(), to_->configuration(), difference_);
  const auto size = static_cast<int>(difference_.size());
  const int linear = from_->kinematics().model().base_rotation_index();
  model.Reset(size, size, 2);
  for (int i = 0; i < size; ++i) model.value(i) = difference_[i];
  for (int i = 0; i < linear; ++i) {
    model.row(0, i)[i] = -1.0;
    model.row(1, i)[i] = 1.0;
  }
  // World increments: q <- (1, phi_to / 2) q (1, -phi_from / 2), hence 2 de = (w I - [e]x) phi_to - (w I + [e]x)
  // phi_from.
  const Eigen::Quaterniond turn = RelativeRotation(from_->configuration(), to_->configuration());
  const Eigen::Vector3d e = turn.vec();
  Eigen::Matrix3d cross;
  cross << 0.0, -e.z(), e.y(), e.z(), 0.0, -e.x(), -e.y(), e.x(), 0.0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double w = i == j ? turn.w() : 0.0;
      model.row(0, linear + i)[linear + j] = -w - cross(i, j);
      model.row(1, linear + i)[linear + j] = w - cross(i, j);
    }
  }
}

}  // namespace legopt
